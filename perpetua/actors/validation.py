"""Whether bodies in motion keep to the floor, to their routes, and out of the scene and of each other.

Depth in the scene is measured from the inside out: each checked vertex belongs to the bone that it keeps closest to,
and a surface between the two means that the vertex is on the wrong side of it. That needs no closed or consistently
oriented furniture. Bones themselves are checked in the same way, which finds limbs that are wholly beyond a wall.
"""

from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64, Int64
from scipy.spatial import cKDTree

from perpetua.actors.config import ValidationConfig
from perpetua.actors.motion.kinematics import CONTACT_JOINTS, contact_positions, joint_index, joint_positions
from perpetua.actors.types import BODY_PARENTS, CONTACTS, ActorMesh, BodyMotion, Route, Skeleton
from perpetua.errors import ActorError
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.raycast import Caster
from perpetua.rooms.types import Room

# A vertex of the sole lies this near to a contact point, in the plane of the sole and above it, in the rest pose.
_SOLE_RADIUS_M, _SOLE_THICKNESS_M = 0.06, 0.025
# Floor is looked for from this far above the route.
_FLOOR_SEARCH_M = 0.3
_BONES = tuple((parent, joint) for joint, parent in enumerate(BODY_PARENTS) if parent >= 0)


@dataclass(frozen=True)
class Worst:
    """The worst value in metres of a figure, the frame it occurs at, and what it concerns."""

    value_m: float
    frame: int
    place: str


@dataclass(frozen=True)
class ActorFigures:
    """How one actor does. Slide is the speed over the floor of soles that stand; medians are over contact frames."""

    actor: int
    slide_median_mps: float
    slide_95th_mps: float
    sole_penetration: Worst
    floating: Worst
    scene_depth: Worst
    path_error: Worst


@dataclass(frozen=True)
class PairFigures:
    """Least distance of two actors at each checked frame."""

    actors: tuple[int, int]
    frames: Int64[np.ndarray, " K"]
    distance_m: Float64[np.ndarray, " K"]


@dataclass(frozen=True)
class ActorReport:
    """Figures of all actors and pairs of actors."""

    actors: tuple[ActorFigures, ...]
    pairs: tuple[PairFigures, ...]

    def to_json(self) -> dict[str, Any]:
        """The report in plain numbers, texts, lists and dictionaries."""
        return {
            "actors": [asdict(figures) for figures in self.actors],
            "pairs": [
                {
                    "actors": list(pair.actors),
                    "least_distance_m": float(pair.distance_m.min()),
                    "frame": int(pair.frames[pair.distance_m.argmin()]),
                    "frames": pair.frames.tolist(),
                    "distance_m": pair.distance_m.tolist(),
                }
                for pair in self.pairs
            ],
        }


@dataclass(frozen=True)
class _Surroundings:
    """The room as obstacles (each face with its object's name) and as floor."""

    obstacles: Caster
    object_names: tuple[str, ...]
    object_of_face: Int64[np.ndarray, " F"]
    floor: Caster


def validate_actors(
    actors: tuple[ActorMesh, ...],
    motions: tuple[BodyMotion, ...],
    skeletons: tuple[Skeleton, ...],
    routes: tuple[Route, ...],
    room: Room,
    fps: float,
    config: ValidationConfig,
) -> ActorReport:
    """Measures posed bodies against their motion, routes, the room and each other.

    Args:
        actors: posed meshes; all tuples in the same order.
        motions: what drove them.
        skeletons: their bones.
        routes: where they were to go.
        room: what stands around them.
        fps: frames per second.
        config: limits, and how many frames and vertices are checked against scene and actors.

    Raises:
        ActorError: a limit is broken; names the actor, the frame, the thing and the value.
    """
    frames = np.unique(np.linspace(0, len(routes[0].heading_rad) - 1, config.frames).astype(np.int64))
    surroundings = _surroundings(room, float(min(route.position_m[:, 2].min() for route in routes)) + config.step_m)
    people = list(zip(actors, motions, skeletons, routes, strict=True))
    report = ActorReport(
        tuple(
            _figures(actor, motion, skeleton, route, surroundings, frames, fps, config)
            for actor, motion, skeleton, route in people
        ),
        tuple(_pair(first, second, frames, config.vertices) for first, second in combinations(actors, 2)),
    )
    check_limits(report, config)
    return report


def check_limits(report: ActorReport, config: ValidationConfig) -> None:
    """Raises ActorError for the first figure of a report that breaks a limit."""
    for figures in report.actors:
        name = f"actor {figures.actor}"
        if figures.slide_95th_mps > config.max_slide_mps:
            raise ActorError(
                f"the soles of {name} slide at {figures.slide_95th_mps:.3f} m/s (95th percentile) while they stand; "
                f"at most {config.max_slide_mps:g} m/s is allowed: choose another seed or raise "
                "actors.validation.max_slide_mps"
            )
        _check(figures.sole_penetration, config.max_sole_penetration_m, name, "max_sole_penetration_m", "sinks", "into")
        _check(figures.floating, config.max_floating_m, name, "max_floating_m", "floats", "above")
        _check(figures.scene_depth, config.max_scene_depth_m, name, "max_scene_depth_m", "goes", "into")
        _check(figures.path_error, config.max_path_error_m, name, "max_path_error_m", "strays", "from")
    for pair in report.pairs:
        nearest = int(pair.distance_m.argmin())
        if pair.distance_m[nearest] < config.min_actor_distance_m:
            raise ActorError(
                f"actors {pair.actors[0]} and {pair.actors[1]} come within {pair.distance_m[nearest]:.3f} m at frame "
                f"{pair.frames[nearest]}; at least {config.min_actor_distance_m:g} m is required: raise "
                "actors.routes.separation_m, lower actors.count or choose a larger room"
            )


def _check(worst: Worst, limit_m: float, name: str, key: str, verb: str, preposition: str) -> None:
    if worst.value_m > limit_m:
        raise ActorError(
            f"{name} {verb} {worst.value_m:.3f} m {preposition} {worst.place} at frame {worst.frame}; at most "
            f"{limit_m:g} m is allowed: choose another seed, raise navigation.body_radius_m for more room, or raise "
            f"actors.validation.{key}"
        )


def _surroundings(room: Room, low_m: float) -> _Surroundings:
    corners: list[np.ndarray] = []
    floors: list[np.ndarray] = []
    owners: list[np.ndarray] = []
    for index, thing in enumerate(room.objects):
        triangles_m = thing.mesh.vertices_m[thing.mesh.faces]
        high = triangles_m[:, :, 2].max(axis=1) > low_m
        corners.append(triangles_m[high])
        owners.append(np.full(int(high.sum()), index, np.int64))
        if thing.walkable:
            floors.append(triangles_m)
    return _Surroundings(
        Caster(_soup(corners)),
        tuple(thing.name for thing in room.objects),
        np.concatenate(owners),
        Caster(_soup(floors)),
    )


def _soup(triangles_m: list[np.ndarray]) -> TriMesh:
    corners_m = np.concatenate([*triangles_m, np.zeros((0, 3, 3))]).reshape(-1, 3)
    return TriMesh(corners_m, np.arange(len(corners_m), dtype=np.int32).reshape(-1, 3))


def _figures(
    actor: ActorMesh,
    motion: BodyMotion,
    skeleton: Skeleton,
    route: Route,
    surroundings: _Surroundings,
    frames: Int64[np.ndarray, " K"],
    fps: float,
    config: ValidationConfig,
) -> ActorFigures:
    joint_m = joint_positions(motion, skeleton)
    slide_mps = _slide_mps(actor, motion, skeleton, fps)
    penetration, floating = _sole_figures(actor, motion, skeleton, route, surroundings.floor)
    away_m = np.linalg.norm(motion.pelvis_m[:, :2] - route.position_m[:, :2], axis=1)
    farthest = int(away_m.argmax())
    return ActorFigures(
        actor.actor,
        float(np.median(slide_mps)) if len(slide_mps) > 0 else 0.0,
        float(np.percentile(slide_mps, 95)) if len(slide_mps) > 0 else 0.0,
        penetration,
        floating,
        _scene_depth(actor, joint_m, surroundings, frames, config.vertices),
        Worst(float(away_m[farthest]), farthest, "its route"),
    )


def _rest_of(
    vertices_m: Float64[np.ndarray, "P 3"], motion: BodyMotion, skeleton: Skeleton, contact: int, frame: int
) -> Float64[np.ndarray, "P 3"]:
    """Vertices of a frame where the contact's joint would carry them back to in the rest pose."""
    joint = joint_index(CONTACT_JOINTS[contact])
    place_m = contact_positions(motion, skeleton)[frame, contact]
    return np.asarray((vertices_m - place_m) @ motion.world_from_joint[frame, joint] + skeleton.contact_m[contact])


def _sole_zone(
    actor: ActorMesh, motion: BodyMotion, skeleton: Skeleton, contact: int
) -> tuple[Int64[np.ndarray, " S"], int]:
    """Vertices of the sole around a contact point, and the one nearest to it, found where the point stands."""
    standing = np.flatnonzero(motion.contacts[:, contact])
    frame = int(standing[0]) if len(standing) > 0 else 0
    rest_m = _rest_of(actor.vertices_m[frame].astype(np.float64), motion, skeleton, contact, frame)
    offset_m = rest_m - skeleton.contact_m[contact]
    nearest = int(np.linalg.norm(offset_m, axis=1).argmin())
    near = (np.linalg.norm(offset_m[:, :2], axis=1) < _SOLE_RADIUS_M) & (np.abs(offset_m[:, 2]) < _SOLE_THICKNESS_M)
    near[nearest] = True
    return np.flatnonzero(near), nearest


def _slide_mps(actor: ActorMesh, motion: BodyMotion, skeleton: Skeleton, fps: float) -> Float64[np.ndarray, " K"]:
    """Speed over the floor of each contact's vertex, over all pairs of frames in which it stands."""
    speeds = [np.zeros(0)]
    for contact in range(len(CONTACTS)):
        _, vertex = _sole_zone(actor, motion, skeleton, contact)
        path_m = actor.vertices_m[:, vertex, :2].astype(np.float64)
        stands = motion.contacts[1:, contact] & motion.contacts[:-1, contact]
        speeds.append(np.linalg.norm(np.diff(path_m, axis=0), axis=1)[stands] * fps)
    return np.concatenate(speeds)


def _sole_figures(
    actor: ActorMesh, motion: BodyMotion, skeleton: Skeleton, route: Route, floor: Caster
) -> tuple[Worst, Worst]:
    """The deepest sole in the floor at any frame, and the highest above it while it is to stand."""
    deepest, highest = Worst(0.0, 0, "the floor"), Worst(0.0, 0, "the floor")
    for contact, name in enumerate(CONTACTS):
        zone, _ = _sole_zone(actor, motion, skeleton, contact)
        sole_m = actor.vertices_m[:, zone].astype(np.float64)
        lowest = sole_m[:, :, 2].argmin(axis=1)
        point_m = sole_m[np.arange(len(sole_m)), lowest]
        height_m = point_m[:, 2] - _floor_z_m(floor, point_m, route)
        place = f"the floor with the {name.replace('_', ' ')}"
        low = int(height_m.argmin())
        if -height_m[low] > deepest.value_m:
            deepest = Worst(float(-height_m[low]), low, place)
        above_m = np.where(motion.contacts[:, contact], height_m, -np.inf)
        high = int(above_m.argmax())
        if above_m[high] > highest.value_m:
            highest = Worst(float(above_m[high]), high, place)
    return deepest, highest


def _floor_z_m(floor: Caster, point_m: Float64[np.ndarray, "T 3"], route: Route) -> Float64[np.ndarray, " T"]:
    """Height of the floor under points; the route's where no walkable surface is below."""
    origin_m = point_m.copy()
    origin_m[:, 2] = route.position_m[:, 2] + _FLOOR_SEARCH_M
    hits = floor.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(point_m), 1)))
    found_m = origin_m[:, 2] - np.where(hits.hit, hits.distance_m, 0.0)
    near = hits.hit & (hits.distance_m < 2.0 * _FLOOR_SEARCH_M)
    return np.where(near, found_m, route.position_m[:, 2])


def _sample(actor: ActorMesh, count: int) -> Int64[np.ndarray, " K"]:
    vertices = actor.vertices_m.shape[1]
    return np.unique(np.linspace(0, vertices - 1, min(count, vertices)).astype(np.int64))


def _anchors(
    vertices_m: Float64[np.ndarray, "K P 3"], joint_m: Float64[np.ndarray, "K 22 3"]
) -> tuple[Int64[np.ndarray, " P"], Float64[np.ndarray, " P"]]:
    """For each vertex the bone that it keeps closest to over some frames, and where along it (0 to 1)."""
    best_m = np.full(vertices_m.shape[1], np.inf)
    bone_of = np.zeros(vertices_m.shape[1], np.int64)
    share_of = np.zeros(vertices_m.shape[1])
    for index, (parent, joint) in enumerate(_BONES):
        start_m, along_m = joint_m[:, None, parent], (joint_m[:, joint] - joint_m[:, parent])[:, None]
        share = np.sum((vertices_m - start_m) * along_m, axis=2) / np.maximum(np.sum(along_m**2, axis=2), 1e-12)
        share = np.clip(share, 0.0, 1.0)
        # A hand may hang beside a thigh at one frame: only what is never far belongs together.
        away_m = np.linalg.norm(vertices_m - start_m - share[..., None] * along_m, axis=2).max(axis=0)
        closer = away_m < best_m
        best_m[closer], bone_of[closer], share_of[closer] = away_m[closer], index, share.mean(axis=0)[closer]
    return bone_of, share_of


def _scene_depth(
    actor: ActorMesh,
    joint_m: Float64[np.ndarray, "T 22 3"],
    surroundings: _Surroundings,
    frames: Int64[np.ndarray, " K"],
    count: int,
) -> Worst:
    vertices_m = actor.vertices_m[np.ix_(frames, _sample(actor, count))].astype(np.float64)
    few = np.unique(np.linspace(0, len(frames) - 1, 8).astype(np.int64))
    bone_of, share_of = _anchors(vertices_m[few], joint_m[frames[few]])
    parents, joints = np.array(_BONES).T
    start_m, end_m = joint_m[np.ix_(frames, parents)], joint_m[np.ix_(frames, joints)]
    anchor_m = start_m[:, bone_of] + share_of[None, :, None] * (end_m - start_m)[:, bone_of]
    inside_m, outside_m = np.concatenate([anchor_m, start_m], axis=1), np.concatenate([vertices_m, end_m], axis=1)
    depth_m, face = _depth_m(surroundings.obstacles, inside_m.reshape(-1, 3), outside_m.reshape(-1, 3))
    deepest = int(depth_m.argmax())
    if depth_m[deepest] == 0.0:
        return Worst(0.0, int(frames[0]), "nothing")
    thing = surroundings.object_names[surroundings.object_of_face[face[deepest]]]
    return Worst(float(depth_m[deepest]), int(frames[deepest // inside_m.shape[1]]), f"'{thing}'")


def _depth_m(
    obstacles: Caster, inside_m: Float64[np.ndarray, "N 3"], outside_m: Float64[np.ndarray, "N 3"]
) -> tuple[Float64[np.ndarray, " N"], Int64[np.ndarray, " N"]]:
    """How far behind the plane of the first surface between them the outer points lie, and that surface's face."""
    offset_m = outside_m - inside_m
    length_m = np.linalg.norm(offset_m, axis=1)
    direction = offset_m / np.maximum(length_m, 1e-9)[:, None]
    direction[length_m < 1e-9] = (0.0, 0.0, 1.0)
    hits = obstacles.first_hit(inside_m, direction)
    crossed: Bool[np.ndarray, " N"] = hits.hit & (hits.distance_m < length_m)
    corners_m = obstacles.mesh.vertices_m[obstacles.mesh.faces[hits.face[crossed]]]
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    depth_m = np.zeros(len(inside_m))
    slope = np.abs(np.sum(normal * direction[crossed], axis=1))
    depth_m[crossed] = (length_m - np.where(crossed, hits.distance_m, 0.0))[crossed] * slope
    return depth_m, hits.face.astype(np.int64)


def _pair(first: ActorMesh, second: ActorMesh, frames: Int64[np.ndarray, " K"], count: int) -> PairFigures:
    distance_m = np.empty(len(frames))
    first_vertices, second_vertices = _sample(first, count), _sample(second, count)
    for row, frame in enumerate(frames):
        tree = cKDTree(second.vertices_m[frame, second_vertices])
        distance_m[row] = tree.query(first.vertices_m[frame, first_vertices])[0].min()
    return PairFigures((first.actor, second.actor), frames, distance_m)
