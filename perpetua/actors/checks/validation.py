"""Whether bodies in motion keep to the floor, to their routes, and out of the scene and of each other."""

from dataclasses import asdict, dataclass
from itertools import combinations
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64
from scipy.spatial import cKDTree

from perpetua.actors.checks.penetration import (
    Obstacles,
    Probe,
    Worst,
    make_floor,
    make_obstacles,
    make_probe,
    overlap_m,
    scene_depth,
)
from perpetua.actors.checks.posture import hands_in_trunk, joint_excess
from perpetua.actors.config import ValidationConfig
from perpetua.errors import ActorError
from perpetua.geometry.raycast import Caster
from perpetua.motion.kinematics import CONTACT_JOINTS, contact_positions, joint_index, joint_positions
from perpetua.scene.actor import CONTACTS, ActorMesh, BodyMotion, Route, Skeleton
from perpetua.scene.room import Room

# A vertex of the sole lies this near to a contact point, in the plane of the sole and above it, in the rest pose.
_SOLE_RADIUS_M, _SOLE_THICKNESS_M = 0.06, 0.025
# Bodies whose checked vertices come this near are tested for overlap.
_TOUCH_M = 0.06
# Hands are looked at in so many frames.
_HAND_FRAMES = 10
# Floor is looked for from this far above the route.
_FLOOR_SEARCH_M = 0.3


@dataclass(frozen=True)
class ActorFigures:
    """How one actor does.

    Slide is the speed over the floor of soles that stand; ``..._99th_m`` is what 99 of 100 standing soles stay under.
    ``hands_in_trunk`` is reported only: hands may rest on a body whose clothes give way.
    """

    actor: int
    slide_median_mps: float
    slide_95th_mps: float
    sole_penetration: Worst
    sole_penetration_99th_m: float
    floating: Worst
    floating_99th_m: float
    scene_depth: Worst
    path_error: Worst
    joint_excess_rad: float
    joint_excess_at: str
    hands_in_trunk: Worst


@dataclass(frozen=True)
class PairFigures:
    """Least distance of two actors at each checked frame; negative is how deep they are in each other."""

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
class _Person:
    """One actor with all that it is measured against, and the vertices that are checked."""

    actor: ActorMesh
    motion: BodyMotion
    skeleton: Skeleton
    route: Route
    joint_m: Float64[np.ndarray, "T 22 3"]
    probe: Probe


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
        ActorError: a limit is broken; names the actor, the frame, the object and the value.
    """
    frames = np.unique(np.linspace(0, len(routes[0].heading_rad) - 1, config.frames).astype(np.int64))
    low_m = float(min(route.position_m[:, 2].min() for route in routes)) + config.step_m
    obstacles, floor = make_obstacles(room, low_m), make_floor(room)
    people = [
        _person(actor, motion, skeleton, route, frames, config.vertices)
        for actor, motion, skeleton, route in zip(actors, motions, skeletons, routes, strict=True)
    ]
    report = ActorReport(
        tuple(_figures(person, obstacles, floor, frames, fps) for person in people),
        tuple(_pair(first, second, frames) for first, second in combinations(people, 2)),
    )
    check_limits(report, config)
    return report


def check_limits(report: ActorReport, config: ValidationConfig) -> None:
    """Raises ActorError for the first figure of a report that breaks a limit."""
    for figures in report.actors:
        _check_slide(figures, config)
        name = f"actor {figures.actor}"
        _check(figures.scene_depth, config.max_scene_depth_m, name, "max_scene_depth_m", "goes", "into")
        _check(figures.path_error, config.max_path_error_m, name, "max_path_error_m", "strays", "from")
        for worst, percentile_m, limit_m, key, verb, preposition in (
            (
                figures.sole_penetration, figures.sole_penetration_99th_m, config.max_sole_penetration_m,
                "max_sole_penetration_m", "sinks", "into",
            ),
            (
                figures.floating, figures.floating_99th_m, config.max_floating_m, "max_floating_m", "floats", "above",
            ),
        ):  # fmt: skip
            if percentile_m > limit_m:
                _check(worst, limit_m, name, key, verb, preposition)
        if figures.joint_excess_rad > config.max_joint_excess_rad:
            raise ActorError(
                f"the {figures.joint_excess_at} of {name} is {figures.joint_excess_rad:.2f} rad beyond what people can "
                f"do; at most {config.max_joint_excess_rad:g} rad is allowed: choose another seed or raise "
                "actors.validation.max_joint_excess_rad"
            )
    for pair in report.pairs:
        nearest = int(pair.distance_m.argmin())
        if -pair.distance_m[nearest] > config.max_actor_overlap_m:
            raise ActorError(
                f"actors {pair.actors[0]} and {pair.actors[1]} are {-pair.distance_m[nearest]:.3f} m in each other at "
                f"frame {pair.frames[nearest]}; at most {config.max_actor_overlap_m:g} m is allowed: raise "
                "actors.routes.separation_m, lower actors.count or choose a larger room"
            )


def _check_slide(figures: ActorFigures, config: ValidationConfig) -> None:
    for speed_mps, what, limit_mps, key in (
        (figures.slide_95th_mps, "95th percentile", config.max_slide_mps, "max_slide_mps"),
        (figures.slide_median_mps, "median", config.max_median_slide_mps, "max_median_slide_mps"),
    ):
        if speed_mps > limit_mps:
            raise ActorError(
                f"the soles of actor {figures.actor} slide at {speed_mps:.3f} m/s ({what}) while they stand; "
                f"at most {limit_mps:g} m/s is allowed: choose another seed or raise actors.validation.{key}"
            )


def _check(worst: Worst, limit_m: float, name: str, key: str, verb: str, preposition: str) -> None:
    if worst.value_m > limit_m:
        raise ActorError(
            f"{name} {verb} {worst.value_m:.3f} m {preposition} {worst.place} at frame {worst.frame}; at most "
            f"{limit_m:g} m is allowed: choose another seed, raise navigation.body_radius_m for more room, or raise "
            f"actors.validation.{key}"
        )


def _person(
    actor: ActorMesh, motion: BodyMotion, skeleton: Skeleton, route: Route, frames: Int64[np.ndarray, " K"], count: int
) -> _Person:
    joint_m = joint_positions(motion, skeleton)
    return _Person(actor, motion, skeleton, route, joint_m, make_probe(actor, joint_m, frames, count))


def _figures(
    person: _Person, obstacles: Obstacles, floor: Caster, frames: Int64[np.ndarray, " K"], fps: float
) -> ActorFigures:
    slide_mps = _slide_mps(person, fps)
    soles = _sole_figures(person, floor)
    excess_rad, frame, joint = joint_excess(person.motion)
    few = frames[:: max(1, len(frames) // _HAND_FRAMES)]
    whole = make_probe(person.actor, person.joint_m, frames, person.actor.vertices_m.shape[1])
    return ActorFigures(
        person.actor.actor,
        float(np.median(slide_mps)) if len(slide_mps) > 0 else 0.0,
        float(np.percentile(slide_mps, 95)) if len(slide_mps) > 0 else 0.0,
        soles.deepest,
        soles.penetration_99th_m,
        soles.highest,
        soles.floating_99th_m,
        scene_depth(person.actor, person.joint_m, person.probe, obstacles, frames),
        _path_error(person),
        excess_rad,
        f"{joint} at frame {frame}",
        hands_in_trunk(person.actor, whole, few),
    )


def _path_error(person: _Person) -> Worst:
    """The farthest pelvis from its route; who sits has left it on purpose."""
    away_m = np.linalg.norm(person.motion.pelvis_m[:, :2] - person.route.position_m[:, :2], axis=1)
    for dwell in person.route.dwells:
        if dwell.purpose == "sit":
            away_m[dwell.first_frame : dwell.last_frame + 1] = 0.0
    farthest = int(away_m.argmax())
    return Worst(float(away_m[farthest]), farthest, "its route")


def _sole_zone(person: _Person, contact: int) -> tuple[Int64[np.ndarray, " S"], int]:
    """Vertices of the sole around a contact point, and the one nearest to it, found where the point stands."""
    standing = np.flatnonzero(person.motion.contacts[:, contact])
    frame = int(standing[0]) if len(standing) > 0 else 0
    world_from_joint = person.motion.world_from_joint[frame, joint_index(CONTACT_JOINTS[contact])]
    place_m = contact_positions(person.motion, person.skeleton)[frame, contact]
    # From the contact point, in the axes of the rest pose.
    offset_m = (person.actor.vertices_m[frame].astype(np.float64) - place_m) @ world_from_joint
    nearest = int(np.linalg.norm(offset_m, axis=1).argmin())
    near = (np.linalg.norm(offset_m[:, :2], axis=1) < _SOLE_RADIUS_M) & (np.abs(offset_m[:, 2]) < _SOLE_THICKNESS_M)
    near[nearest] = True
    return np.flatnonzero(near), nearest


def _slide_mps(person: _Person, fps: float) -> Float64[np.ndarray, " K"]:
    """Speed over the floor of each contact's vertex, over all pairs of frames in which it stands."""
    contacts = person.motion.contacts
    speeds = [np.zeros(0)]
    for contact in range(len(CONTACTS)):
        _, vertex = _sole_zone(person, contact)
        path_m = person.actor.vertices_m[:, vertex, :2].astype(np.float64)
        stands = contacts[1:, contact] & contacts[:-1, contact]
        speeds.append(np.linalg.norm(np.diff(path_m, axis=0), axis=1)[stands] * fps)
    return np.concatenate(speeds)


@dataclass(frozen=True)
class _Soles:
    """The deepest sole in the floor at any frame, the highest above it while it is to stand, and 99th percentiles."""

    deepest: Worst
    penetration_99th_m: float
    highest: Worst
    floating_99th_m: float


def _sole_figures(person: _Person, floor: Caster) -> _Soles:
    deepest, highest = Worst(0.0, 0, "the floor"), Worst(0.0, 0, "the floor")
    standing_m = [np.zeros(0)]
    for contact, name in enumerate(CONTACTS):
        zone, _ = _sole_zone(person, contact)
        sole_m = person.actor.vertices_m[:, zone].astype(np.float64)
        point_m = sole_m[np.arange(len(sole_m)), sole_m[:, :, 2].argmin(axis=1)]
        height_m = point_m[:, 2] - _floor_z_m(floor, point_m, person.route)
        place = f"the floor with the {name.replace('_', ' ')}"
        low = int(height_m.argmin())
        if -height_m[low] > deepest.value_m:
            deepest = Worst(float(-height_m[low]), low, place)
        stands = person.motion.contacts[:, contact]
        above_m = np.where(stands, height_m, -np.inf)
        high = int(above_m.argmax())
        if above_m[high] > highest.value_m:
            highest = Worst(float(above_m[high]), high, place)
        standing_m.append(height_m[stands])
    all_m = np.concatenate(standing_m)
    if len(all_m) == 0:
        return _Soles(deepest, 0.0, highest, 0.0)
    return _Soles(
        deepest,
        max(-float(np.percentile(all_m, 1.0)), 0.0),
        highest,
        max(float(np.percentile(all_m, 99.0)), 0.0),
    )


def _floor_z_m(floor: Caster, point_m: Float64[np.ndarray, "T 3"], route: Route) -> Float64[np.ndarray, " T"]:
    """Height of the floor under points; the route's where no walkable surface is below."""
    origin_m = point_m.copy()
    origin_m[:, 2] = route.position_m[:, 2] + _FLOOR_SEARCH_M
    hits = floor.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(point_m), 1)))
    found_m = origin_m[:, 2] - np.where(hits.hit, hits.distance_m, 0.0)
    near = hits.hit & (hits.distance_m < 2.0 * _FLOOR_SEARCH_M)
    return np.where(near, found_m, route.position_m[:, 2])


def _pair(first: _Person, second: _Person, frames: Int64[np.ndarray, " K"]) -> PairFigures:
    distance_m = np.empty(len(frames))
    for row, frame in enumerate(frames):
        tree = cKDTree(second.actor.vertices_m[frame, second.probe.vertices])
        points_m = first.actor.vertices_m[frame, first.probe.vertices]
        # A few points bound the search for the others, which is slow only where nothing can be ruled out.
        bound_m = tree.query(points_m[::40])[0].min()
        distance_m[row] = min(bound_m, tree.query(points_m, distance_upper_bound=bound_m)[0].min())
        if distance_m[row] < _TOUCH_M:
            overlaps_m = [
                overlap_m(one.actor, one.joint_m, one.probe, other.actor, int(frame))
                for one, other in ((first, second), (second, first))
            ]
            distance_m[row] = -max(overlaps_m) if max(overlaps_m) > 0.0 else distance_m[row]
    return PairFigures((first.actor.actor, second.actor.actor), frames, distance_m)
