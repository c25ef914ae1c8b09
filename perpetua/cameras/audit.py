"""The hard rules of camera paths, checked against the true triangles; shares no code with the optimiser."""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int32

from perpetua.actors.types import ActorMesh
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.types import CameraPath
from perpetua.cameras.views import view_coverage
from perpetua.geometry.raycast import Caster
from perpetua.rooms.types import Room

SUBSTEPS = 4
SUBSTEP_M = 0.02
# Half of an actor's sampled head and torso points make it seen.
SEEN_SHARE = 0.5


@dataclass(frozen=True)
class Violation:
    """One rule that one view breaks at its worst: ``message`` states rule, value and remedy."""

    camera: int
    rule: str
    value: float
    limit: float
    message: str


@dataclass(frozen=True)
class CameraAudit:
    """Figures of C views, and what breaks a rule."""

    scene_distance_m: Float64[np.ndarray, " C"]
    actor_distance_m: Float64[np.ndarray, " C"]
    focus_share: Float64[np.ndarray, " C"]
    travel_m: Float64[np.ndarray, " C"]
    violations: tuple[Violation, ...]

    @property
    def passed(self) -> bool:
        """Whether every rule is kept."""
        return not self.violations


def audit_paths(
    paths: tuple[CameraPath, ...],
    focus: Bool[np.ndarray, "C T A"],
    room: Room,
    actors: tuple[ActorMesh, ...],
    caster: Caster,
    fps: float,
    config: CamerasConfig,
) -> CameraAudit:
    """Checks paths between frames too, at sub-steps of at most 2 cm and a quarter of a frame.

    Args:
        paths: one per view.
        focus: whom each view is to show; it must see one of them in ``config.min_focus_share`` of the frames.
        room: gives the floor polygon and height that cameras stay in.
        actors: the posed meshes; between frames their vertices move on straight lines.
        caster: casts against the join of all the room's meshes.
        fps: frames per second.
        config: the limits.
    """
    coverage = view_coverage(paths, actors, caster)
    seen = ((coverage.seen_share >= SEEN_SHARE) & focus).any(axis=-1).mean(axis=-1)
    scene_m, actor_m, travel_m, violations = [], [], [], []
    for view, path in enumerate(paths):
        position_m = path.world_from_camera[:, :3, 3]
        swept = _sweep(position_m)
        scene_m.append(float(caster.closest_distance(swept.position_m, 10.0).min()))
        actor_m.append(min(_actor_distance_m(swept, actor) for actor in actors))
        travel_m.append(float(np.linalg.norm(np.diff(position_m, axis=0), axis=1).sum()))
        figures = _figures(path, swept, room, fps) | {
            "scene": scene_m[-1],
            "actor": actor_m[-1],
            "focus": float(seen[view]),
        }
        violations += _violations(path.camera, figures, config)
    return CameraAudit(np.array(scene_m), np.array(actor_m), seen, np.array(travel_m), tuple(violations))


@dataclass(frozen=True)
class _Sweep:
    """Positions at sub-steps, each at ``share`` of the way from ``frame`` to the next."""

    position_m: Float64[np.ndarray, "N 3"]
    frame: Int32[np.ndarray, " N"]
    share: Float64[np.ndarray, " N"]


def _sweep(position_m: Float64[np.ndarray, "T 3"]) -> _Sweep:
    longest_m = float(np.linalg.norm(np.diff(position_m, axis=0), axis=1).max(initial=0.0))
    steps = max(SUBSTEPS, int(np.ceil(longest_m / SUBSTEP_M)))
    time = np.linspace(0.0, len(position_m) - 1.0, (len(position_m) - 1) * steps + 1)
    frame = np.minimum(time.astype(np.int32), len(position_m) - 2)
    share = time - frame
    between = position_m[frame] + share[:, None] * (position_m[frame + 1] - position_m[frame])
    return _Sweep(between, frame, share)


def _actor_distance_m(swept: _Sweep, actor: ActorMesh) -> float:
    """Least distance to an actor's triangles over all sub-steps.

    The distance changes by no more than camera and vertices move, and the mesh lies within its box: sub-steps are
    measured in the order of what they could still be, until none can be nearer than the nearest measured.
    """
    could_be_m = _box_distance_m(swept, actor)
    moved_m = _motion_m(swept, actor)
    faces = actor.faces
    nearest_m = np.inf
    while could_be_m.min() < nearest_m:
        step = int(could_be_m.argmin())
        frame, share = swept.frame[step], swept.share[step]
        start_m, end_m = actor.vertices_m[frame : frame + 2].astype(np.float64)
        distance_m = _mesh_distance_m(swept.position_m[step], (1.0 - share) * start_m + share * end_m, faces)
        nearest_m = min(nearest_m, distance_m)
        could_be_m = np.maximum(could_be_m, distance_m - np.abs(moved_m - moved_m[step]))
        could_be_m[step] = np.inf
    return nearest_m


def _box_distance_m(swept: _Sweep, actor: ActorMesh) -> Float64[np.ndarray, " N"]:
    low_m, high_m = actor.vertices_m.min(axis=1), actor.vertices_m.max(axis=1)
    low_m = np.minimum(low_m[swept.frame], low_m[swept.frame + 1])
    high_m = np.maximum(high_m[swept.frame], high_m[swept.frame + 1])
    beyond_m = np.maximum(np.maximum(low_m - swept.position_m, swept.position_m - high_m), 0.0)
    return np.asarray(np.linalg.norm(beyond_m, axis=1))


def _motion_m(swept: _Sweep, actor: ActorMesh) -> Float64[np.ndarray, " N"]:
    """How far the camera and the actor's fastest vertex have moved together since the start."""
    fastest_m = np.linalg.norm(np.diff(actor.vertices_m, axis=0), axis=2).max(axis=1)
    camera_m = np.linalg.norm(np.diff(swept.position_m, axis=0), axis=1)
    actor_m = np.concatenate([[0.0], np.cumsum(fastest_m, dtype=np.float64)])
    actor_m = actor_m[swept.frame] + swept.share * fastest_m[swept.frame]
    return np.asarray(np.concatenate([[0.0], np.cumsum(camera_m)]) + actor_m)


def _mesh_distance_m(
    point_m: Float64[np.ndarray, "3"], vertices_m: Float64[np.ndarray, "P 3"], faces: Int32[np.ndarray, "F 3"]
) -> float:
    to_vertex_m = np.linalg.norm(vertices_m - point_m, axis=1)[faces]
    # A triangle's points are no nearer than its nearest corner less its longest edge.
    corners_m = vertices_m[faces]
    edge_m = np.linalg.norm(corners_m - np.roll(corners_m, 1, axis=1), axis=2).max(axis=1)
    near = to_vertex_m.min(axis=1) - edge_m <= to_vertex_m.min()
    closest_m = trimesh.triangles.closest_point(corners_m[near], np.repeat(point_m[None], near.sum(), axis=0))
    return float(np.linalg.norm(closest_m - point_m, axis=1).min())


def _figures(path: CameraPath, swept: _Sweep, room: Room, fps: float) -> dict[str, float]:
    position_m, forward = path.world_from_camera[:, :3, 3], path.world_from_camera[:, :3, 2]
    velocity = np.diff(position_m, axis=0) * fps
    acceleration = np.diff(velocity, axis=0) * fps
    turn = np.arccos(np.clip(np.einsum("ti,ti->t", forward[1:], forward[:-1]), -1.0, 1.0)) * fps
    height_m = np.minimum(swept.position_m[:, 2], room.height_m - swept.position_m[:, 2])
    inside = _winds_around(room.floor_polygon_m, swept.position_m[:, :2])
    return {
        "room": float((inside & (height_m > 0.0)).mean()),
        "speed": float(np.linalg.norm(velocity, axis=1).max()),
        "acceleration": float(np.linalg.norm(acceleration, axis=1).max(initial=0.0)),
        "turn": float(np.degrees(turn.max())),
        "pitch": float(np.degrees(np.arcsin(np.abs(forward[:, 2]).max()))),
    }


def _winds_around(
    polygon_m: Float64[np.ndarray, "K 2"], points_m: Float64[np.ndarray, "N 2"]
) -> Bool[np.ndarray, " N"]:
    """Whether the polygon's outline turns once around each point."""
    offset = polygon_m[None] - points_m[:, None]
    following = np.roll(offset, -1, axis=1)
    cross = offset[..., 0] * following[..., 1] - offset[..., 1] * following[..., 0]
    angle = np.arctan2(cross, (offset * following).sum(axis=-1)).sum(axis=1)
    return np.asarray(np.abs(angle) > np.pi)


def _violations(camera: int, figures: dict[str, float], config: CamerasConfig) -> list[Violation]:
    least = {
        "room": (1.0, "share of the way inside the room is", "choose a larger room"),
        "scene": (config.scene_clearance_m, "least distance to the scene in metres is", "lower cameras.voxel_m"),
        "actor": (config.actor_clearance_m, "least distance to an actor in metres is", "choose a larger room"),
        "focus": (config.min_focus_share, "share of frames that show its focus is", "lower cameras.min_focus_share"),
    }
    most = {
        "speed": (config.max_speed_mps, "greatest speed in m/s is", "raise cameras.max_speed_mps"),
        "acceleration": (
            config.max_acceleration_mps2,
            "greatest acceleration in m/s^2 is",
            "raise cameras.max_acceleration_mps2",
        ),
        "turn": (config.max_turn_deg_per_s, "fastest turn in degrees/s is", "raise cameras.max_turn_deg_per_s"),
        "pitch": (config.max_pitch_deg, "steepest view in degrees is", "raise cameras.max_pitch_deg"),
    }
    found = [(rule, "at least", *entry) for rule, entry in least.items() if figures[rule] < entry[0]]
    found += [(rule, "at most", *entry) for rule, entry in most.items() if figures[rule] > entry[0]]
    return [
        Violation(
            camera,
            rule,
            figures[rule],
            limit,
            f"camera {camera}: {what} {figures[rule]:.3f}; {side} {limit:g} is required: {remedy}",
        )
        for rule, side, limit, what, remedy in found
    ]
