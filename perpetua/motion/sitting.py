"""Sitting down on a seat, resting there, and standing up again.

A dwell with the purpose "sit" finds the actor standing in front of the seat with its back to it. It steps back until
its feet are near the seat, leans forward, lowers its hips onto the surface, sits, and does the same backwards.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.raycast import Caster
from perpetua.motion.kinematics import bone
from perpetua.motion.seated_pose import BACK_FLESH_M, SeatedPose, ahead_of, settle
from perpetua.scene.actor import Dwell, Route, Seat, Skeleton
from perpetua.scene.room import Room

logger = logging.getLogger(__name__)

DOWN_S, UP_S = 1.2, 1.05
SETTLE_S = 0.14
_LEAST_REST_S, _BACK_STEP_MPS, _LEAST_BACK_S = 0.3, 0.45, 0.4
# The front of knees, shins and toes: ahead of the ankle, and above the floor; to either side; and the room they need.
_LEG_FRONT_M, _LEG_ASIDE_M, _LEG_ROOM_M = ((0.05, 0.45), (0.08, 0.25), (0.16, 0.08)), 0.13, 0.05
_REST_LEANS_RAD = (-0.16, -0.08, 0.0, 0.08, 0.16, 0.24)


@dataclass(frozen=True)
class Sitting:
    """One sit: times in seconds, where hips and feet are, and the trunk's lean at rest.

    ``axis_m`` is where the body's axis stands (x, y) while feet are planted, ``hip_m`` the middle of the hip joints at
    rest, ``heel_rad`` how far the heels are raised then.
    """

    arrive_s: float
    down_s: float
    rise_s: float
    leave_s: float
    facing_rad: float
    axis_m: Float64[np.ndarray, "2"]
    hip_m: Float64[np.ndarray, "3"]
    heel_rad: float
    lean_rad: float


def plan_sittings(route: Route, skeleton: Skeleton, room: Room, fps: float) -> tuple[Sitting, ...]:
    """The sits of a route; one that the body, the time or the seat does not allow is left out, and logged."""
    wanted = [dwell for dwell in route.dwells if dwell.purpose == "sit"]
    if not wanted:
        return ()
    caster = room.surfaces.caster
    planned = []
    for dwell in wanted:
        sitting = _plan(dwell, route, skeleton, caster, fps)
        if sitting is None:
            logger.info("actor %d stands by its seat: there is no room or time to sit", route.actor)
        else:
            planned.append(sitting)
    return tuple(planned)


def without_failed_sits(route: Route, sittings: tuple[Sitting, ...], fps: float) -> Route:
    """The route with each dwell at which nobody sits turned into one of looking about."""
    begun = [sitting.arrive_s for sitting in sittings]
    dwells = tuple(
        replace(dwell, purpose="look", target_m=_beyond(route, dwell), seat=None)
        if dwell.purpose == "sit" and not any(abs(arrive_s - dwell.first_frame / fps) < 0.5 / fps for arrive_s in begun)
        else dwell
        for dwell in route.dwells
    )
    return replace(route, dwells=dwells)


def _plan(dwell: Dwell, route: Route, skeleton: Skeleton, caster: Caster, fps: float) -> Sitting | None:
    seat = dwell.seat
    if seat is None:
        return None
    standing_m = route.position_m[(dwell.first_frame + dwell.last_frame) // 2]
    pose = settle(seat, standing_m, skeleton)
    if pose is None:
        return None
    lean_rad = _rest_lean_rad(seat, pose)
    times_s = _times_s(dwell, route, seat, pose, fps)
    if lean_rad is None or times_s is None or not _legs_fit(seat, pose, float(standing_m[2]), caster):
        return None
    ankle_ahead_m = float(bone(skeleton, "pelvis", "left_ankle")[0])
    axis_m = pose.hip_m[:2] + (pose.ahead_m - ankle_ahead_m) * ahead_of(seat.facing_rad)
    return Sitting(*times_s, seat.facing_rad, axis_m, pose.hip_m, pose.heel_rad, lean_rad)


def _legs_fit(seat: Seat, pose: SeatedPose, floor_m: float, caster: Caster) -> bool:
    """Whether nothing stands where knees, shins and toes come to be."""
    ahead = ahead_of(seat.facing_rad)
    left = np.array([-ahead[1], ahead[0]])
    front_m = [
        np.append(pose.hip_m[:2] + (pose.ahead_m + forward_m) * ahead + aside_m * left, floor_m + height_m)
        for forward_m, height_m in _LEG_FRONT_M
        for aside_m in (-_LEG_ASIDE_M, _LEG_ASIDE_M)
    ]
    return bool(caster.closest_distance(np.array(front_m), 2.0 * _LEG_ROOM_M).min() >= _LEG_ROOM_M)


def _rest_lean_rad(seat: Seat, pose: SeatedPose) -> float | None:
    """The first lean at which the back stays clear of the backrest; None where the body does not fit at all."""
    forward_m = float((pose.hip_m[:2] - seat.middle_m[:2]) @ ahead_of(seat.facing_rad))
    rise_m = float(pose.hip_m[2] - seat.top_m)
    leans_rad = _REST_LEANS_RAD if min(distance_m for _, distance_m in seat.backs_m) < 0.5 else _REST_LEANS_RAD[1:]
    for lean_rad in leans_rad:
        gaps_m = [
            distance_m + forward_m + np.tan(lean_rad) * max(level_m - rise_m, 0.0) - BACK_FLESH_M
            for level_m, distance_m in seat.backs_m
        ]
        if min(gaps_m) >= 0.0:
            return lean_rad
    return None


def _times_s(
    dwell: Dwell, route: Route, seat: Seat, pose: SeatedPose, fps: float
) -> tuple[float, float, float, float] | None:
    """When it arrives, goes down, rises and leaves; a dwell at an end of the route is sat out there."""
    arrive_s, leave_s = dwell.first_frame / fps, dwell.last_frame / fps
    standing_m = route.position_m[(dwell.first_frame + dwell.last_frame) // 2, :2]
    step_m = float(np.linalg.norm(pose.hip_m[:2] + pose.ahead_m * ahead_of(seat.facing_rad) - standing_m))
    step_s = max(_LEAST_BACK_S, step_m / _BACK_STEP_MPS) if step_m > 0.04 else 0.0
    last = dwell.last_frame >= len(route.heading_rad) - 1
    down_s = arrive_s + step_s + SETTLE_S if dwell.first_frame > 0 else arrive_s - 20.0
    rise_s = leave_s - step_s - SETTLE_S - UP_S if not last else leave_s + 20.0
    if rise_s - (down_s + DOWN_S) < _LEAST_REST_S:
        return None
    return arrive_s, down_s, rise_s, leave_s


def _beyond(route: Route, dwell: Dwell) -> tuple[float, float, float]:
    """A place in front of the actor at eye height."""
    middle = (dwell.first_frame + dwell.last_frame) // 2
    x_m, y_m, z_m = route.position_m[middle]
    ahead = ahead_of(float(route.heading_rad[middle]) + 0.4)
    return float(x_m + 3.0 * ahead[0]), float(y_m + 3.0 * ahead[1]), float(z_m + 1.3)
