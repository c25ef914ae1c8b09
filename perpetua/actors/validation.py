"""Whether bodies in motion keep to the floor, to their routes, and out of the scene and of each other."""

from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial import cKDTree

from perpetua.actors.config import ValidationConfig
from perpetua.actors.motion.kinematics import CONTACT_JOINTS, contact_positions, joint_index, joint_positions
from perpetua.actors.penetration import Obstacles, Worst, make_floor, make_obstacles, sampled_vertices, scene_depth
from perpetua.actors.types import CONTACTS, ActorMesh, BodyMotion, Route, Skeleton
from perpetua.errors import ActorError
from perpetua.geometry.raycast import Caster
from perpetua.rooms.types import Room

# A vertex of the sole lies this near to a contact point, in the plane of the sole and above it, in the rest pose.
_SOLE_RADIUS_M, _SOLE_THICKNESS_M = 0.06, 0.025
# Floor is looked for from this far above the route.
_FLOOR_SEARCH_M = 0.3


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
    low_m = float(min(route.position_m[:, 2].min() for route in routes)) + config.step_m
    obstacles, floor = make_obstacles(room, low_m), make_floor(room)
    people = list(zip(actors, motions, skeletons, routes, strict=True))
    report = ActorReport(
        tuple(
            _figures(actor, motion, skeleton, route, obstacles, floor, frames, fps, config)
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


def _figures(
    actor: ActorMesh,
    motion: BodyMotion,
    skeleton: Skeleton,
    route: Route,
    obstacles: Obstacles,
    floor: Caster,
    frames: Int64[np.ndarray, " K"],
    fps: float,
    config: ValidationConfig,
) -> ActorFigures:
    joint_m = joint_positions(motion, skeleton)
    slide_mps = _slide_mps(actor, motion, skeleton, fps)
    penetration, floating = _sole_figures(actor, motion, skeleton, route, floor)
    away_m = np.linalg.norm(motion.pelvis_m[:, :2] - route.position_m[:, :2], axis=1)
    farthest = int(away_m.argmax())
    return ActorFigures(
        actor.actor,
        float(np.median(slide_mps)) if len(slide_mps) > 0 else 0.0,
        float(np.percentile(slide_mps, 95)) if len(slide_mps) > 0 else 0.0,
        penetration,
        floating,
        scene_depth(actor, joint_m, obstacles, frames, config.vertices),
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


def _pair(first: ActorMesh, second: ActorMesh, frames: Int64[np.ndarray, " K"], count: int) -> PairFigures:
    distance_m = np.empty(len(frames))
    first_vertices, second_vertices = sampled_vertices(first, count), sampled_vertices(second, count)
    for row, frame in enumerate(frames):
        tree = cKDTree(second.vertices_m[frame, second_vertices])
        points_m = first.vertices_m[frame, first_vertices]
        # A few points bound the search for the others, which is slow only where nothing can be ruled out.
        bound_m = tree.query(points_m[::40])[0].min()
        near_m = tree.query(points_m, distance_upper_bound=bound_m)[0].min()
        distance_m[row] = min(bound_m, near_m)
    return PairFigures((first.actor, second.actor), frames, distance_m)
