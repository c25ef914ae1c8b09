"""Whether bodies in motion keep to the floor, to their routes, and out of the scene and of each other."""

from itertools import combinations

import numpy as np
from jaxtyping import Int64
from scipy.spatial import cKDTree

from perpetua.actors.checks.checked_actor import CheckedActor, checked_actor
from perpetua.actors.checks.figures import ActorFigures, ActorReport, PairFigures
from perpetua.actors.checks.limits import check_limits
from perpetua.actors.checks.penetration import (
    Obstacles,
    Worst,
    make_floor,
    make_obstacles,
    make_probe,
    overlap_m,
    scene_depth,
)
from perpetua.actors.checks.posture import hands_in_trunk, joint_excess
from perpetua.actors.checks.soles import slide_mps, sole_figures
from perpetua.actors.config import ValidationConfig
from perpetua.geometry.raycast import Caster
from perpetua.scene.actor import ActorMesh, BodyMotion, Route, Skeleton
from perpetua.scene.room import Room

# Bodies whose checked vertices come this near are tested for overlap.
_TOUCH_M = 0.06
# Hands are looked at in so many frames.
_HAND_FRAMES = 10


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
        checked_actor(actor, motion, skeleton, route, frames, config.vertices)
        for actor, motion, skeleton, route in zip(actors, motions, skeletons, routes, strict=True)
    ]
    report = ActorReport(
        tuple(_figures(checked, obstacles, floor, frames, fps) for checked in people),
        tuple(_pair(first, second, frames) for first, second in combinations(people, 2)),
    )
    check_limits(report, config)
    return report


def _figures(
    checked: CheckedActor, obstacles: Obstacles, floor: Caster, frames: Int64[np.ndarray, " K"], fps: float
) -> ActorFigures:
    slides_mps = slide_mps(checked, fps)
    soles = sole_figures(checked, floor)
    excess_rad, frame, joint = joint_excess(checked.motion)
    few = frames[:: max(1, len(frames) // _HAND_FRAMES)]
    whole = make_probe(checked.actor, checked.joint_m, frames, checked.actor.vertices_m.shape[1])
    return ActorFigures(
        checked.actor.actor,
        float(np.median(slides_mps)) if len(slides_mps) > 0 else 0.0,
        float(np.percentile(slides_mps, 95)) if len(slides_mps) > 0 else 0.0,
        soles.deepest,
        soles.penetration_99th_m,
        soles.highest,
        soles.floating_99th_m,
        scene_depth(checked.actor, checked.joint_m, checked.probe, obstacles, frames),
        _path_error(checked),
        excess_rad,
        f"{joint} at frame {frame}",
        hands_in_trunk(checked.actor, whole, few),
    )


def _path_error(checked: CheckedActor) -> Worst:
    """The farthest pelvis from its route; who sits has left it on purpose."""
    away_m = np.linalg.norm(checked.motion.pelvis_m[:, :2] - checked.route.position_m[:, :2], axis=1)
    for dwell in checked.route.dwells:
        if dwell.purpose == "sit":
            away_m[dwell.first_frame : dwell.last_frame + 1] = 0.0
    farthest = int(away_m.argmax())
    return Worst(float(away_m[farthest]), farthest, "its route")


def _pair(first: CheckedActor, second: CheckedActor, frames: Int64[np.ndarray, " K"]) -> PairFigures:
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
