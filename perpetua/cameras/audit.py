"""The hard rules of camera paths, checked against the true triangles; shares no code with the optimiser."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int32

from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.moving_mesh import MovingMesh
from perpetua.cameras.views import view_coverage
from perpetua.geometry.raycast import Caster
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

SUBSTEPS = 4
SUBSTEP_M = 0.02


@dataclass(frozen=True)
class Violation:
    """One rule that ``subject`` (a view, or an actor) breaks: ``message`` states rule, value and remedy."""

    subject: str
    rule: str
    value: float
    limit: float
    message: str


@dataclass(frozen=True)
class CameraAudit:
    """Figures of C views and A actors, and what breaks a rule.

    ``focus_fraction`` is the share of frames in which a view sees one of its focus actors, ``covered_fraction`` that in
    which enough views see an actor, ``apart_deg`` the mean angle between the two most different views that see it.
    """

    scene_distance_m: Float64[np.ndarray, " C"]
    actor_distance_m: Float64[np.ndarray, " C"]
    focus_fraction: Float64[np.ndarray, " C"]
    travel_m: Float64[np.ndarray, " C"]
    covered_fraction: Float64[np.ndarray, " A"]
    apart_deg: Float64[np.ndarray, " A"]
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
    meshes: tuple[MovingMesh, ...],
    caster: Caster,
    fps: float,
    config: CamerasConfig,
) -> CameraAudit:
    """Checks paths between frames too, at sub-steps of at most 2 cm and a quarter of a frame.

    Args:
        paths: one per view.
        focus: whom each view is to show; it must see one of them in ``config.min_focus_share`` of the frames.
        room: gives the floor polygon and height that cameras stay in.
        actors: the posed meshes.
        meshes: the same, ready to be measured; between frames their vertices move on straight lines.
        caster: casts against the join of all the room's meshes.
        fps: frames per second.
        config: the limits.
    """
    coverage = view_coverage(paths, actors, caster)
    seen = (coverage.sees & focus).any(axis=-1).mean(axis=-1)
    covered = (coverage.sees.sum(axis=0) >= config.views_per_actor).mean(axis=0)
    apart_deg = _mean_apart_deg(coverage.apart_rad)
    scene_m, actor_m, travel_m, violations = [], [], [], []
    for view, path in enumerate(paths):
        position_m = path.world_from_camera[:, :3, 3]
        swept = _sweep(position_m)
        scene_m.append(float(caster.closest_distance(swept.position_m, 10.0).min()))
        actor_m.append(min(mesh.least_distance_m(swept.position_m, swept.frame, swept.fraction) for mesh in meshes))
        travel_m.append(float(np.linalg.norm(np.diff(position_m, axis=0), axis=1).sum()))
        figures = _figures(path, swept, room, fps) | {
            "scene": scene_m[-1],
            "actor": actor_m[-1],
            "focus": float(seen[view]),
        }
        violations += _violations(f"camera {path.camera}", figures, _view_rules(config))
    for actor, fraction, angle_deg in zip(actors, covered, apart_deg, strict=True):
        figures = {"coverage": float(fraction), "apart": float(angle_deg)}
        violations += _violations(f"actor {actor.actor}", figures, _actor_rules(config))
    return CameraAudit(
        np.array(scene_m), np.array(actor_m), seen, np.array(travel_m), covered, apart_deg, tuple(violations)
    )


def _mean_apart_deg(apart_rad: Float64[np.ndarray, "T A"]) -> Float64[np.ndarray, " A"]:
    """Mean over the frames in which at least two views see the actor; 0 where there is none."""
    known = np.isfinite(apart_rad)
    total = np.where(known, apart_rad, 0.0).sum(axis=0)
    return np.asarray(np.degrees(total / np.maximum(known.sum(axis=0), 1)))


@dataclass(frozen=True)
class _Sweep:
    """Positions at sub-steps, each at ``fraction`` of the way from ``frame`` to the next."""

    position_m: Float64[np.ndarray, "N 3"]
    frame: Int32[np.ndarray, " N"]
    fraction: Float64[np.ndarray, " N"]


def _sweep(position_m: Float64[np.ndarray, "T 3"]) -> _Sweep:
    longest_m = float(np.linalg.norm(np.diff(position_m, axis=0), axis=1).max(initial=0.0))
    steps = max(SUBSTEPS, int(np.ceil(longest_m / SUBSTEP_M)))
    time = np.linspace(0.0, len(position_m) - 1.0, (len(position_m) - 1) * steps + 1)
    frame = np.minimum(time.astype(np.int32), len(position_m) - 2)
    fraction = time - frame
    between = position_m[frame] + fraction[:, None] * (position_m[frame + 1] - position_m[frame])
    return _Sweep(between, frame, fraction)


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


@dataclass(frozen=True)
class _Rule:
    """A figure's limit: the least or the most it may be."""

    name: str
    least: bool
    limit: float
    what: str
    remedy: str


def _view_rules(config: CamerasConfig) -> tuple[_Rule, ...]:
    turn, pitch = config.max_turn_deg_per_s, config.max_pitch_deg
    speed, acceleration = config.max_speed_mps, config.max_acceleration_mps2
    focus = "share of frames that show its focus is"
    return (
        _Rule("room", True, 1.0, "share of the way inside the room is", "choose a larger room"),
        _Rule(
            "scene", True, config.scene_clearance_m, "least distance to the scene in metres is", "lower cameras.voxel_m"
        ),
        _Rule(
            "actor", True, config.actor_clearance_m, "least distance to an actor in metres is", "choose a larger room"
        ),
        _Rule("focus", True, config.min_focus_share, focus, "lower cameras.min_focus_share"),
        _Rule("speed", False, speed, "greatest speed in m/s is", "raise cameras.max_speed_mps"),
        _Rule(
            "acceleration",
            False,
            acceleration,
            "greatest acceleration in m/s^2 is",
            "raise cameras.max_acceleration_mps2",
        ),
        _Rule("turn", False, turn, "fastest turn in degrees/s is", "raise cameras.max_turn_deg_per_s"),
        _Rule("pitch", False, pitch, "steepest view in degrees is", "raise cameras.max_pitch_deg"),
    )


def _actor_rules(config: CamerasConfig) -> tuple[_Rule, ...]:
    if config.views_per_actor == 0:
        return ()
    seen = f"share of frames in which {config.views_per_actor} or more views see it is"
    rules = (_Rule("coverage", True, config.min_covered_share, seen, "lower cameras.min_covered_share"),)
    if config.views_per_actor < 2:
        return rules
    apart = "mean angle in degrees between the most different views that see it is"
    return (*rules, _Rule("apart", True, config.min_apart_deg, apart, "lower cameras.min_apart_deg"))


def _violations(subject: str, figures: dict[str, float], rules: tuple[_Rule, ...]) -> list[Violation]:
    broken = [rule for rule in rules if (figures[rule.name] - rule.limit) * (1.0 if rule.least else -1.0) < 0.0]
    return [
        Violation(
            subject,
            rule.name,
            figures[rule.name],
            rule.limit,
            f"{subject}: {rule.what} {figures[rule.name]:.3f}; {'at least' if rule.least else 'at most'} "
            f"{rule.limit:g} is required: {rule.remedy}",
        )
        for rule in broken
    ]
