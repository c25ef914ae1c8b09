"""Sitting down on a seat, resting there, and standing up again.

A dwell with the purpose "sit" finds the actor standing in front of the seat with its back to it. It steps back until
its feet are near the seat, leans forward, lowers its hips onto the surface, sits, and does the same backwards.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.mesh import join
from perpetua.geometry.raycast import Caster
from perpetua.motion.feet import FootTrack
from perpetua.motion.kinematics import bone
from perpetua.motion.legs import foot_of, leg_of
from perpetua.motion.rotations import about_y, about_z, rotate, smoothstep
from perpetua.scene.actor import Dwell, Route, Skeleton
from perpetua.scene.room import Room

logger = logging.getLogger(__name__)

DOWN_S, UP_S = 1.2, 1.05
_SETTLE_S, _LEAST_REST_S, _BACK_STEP_MPS, _LEAST_BACK_S = 0.14, 0.3, 0.45, 0.4
# Flesh between the hip joints and the seat, in lengths of the thigh, where the body does not say.
_FLESH_FRACTION = 0.235
# Under the thigh there is less of it, and a cushion gives way by so much.
_THIGH_FRACTION, _GIVE_M = 0.85, 0.003
# Skirts that hang lower than this would hang through the seat.
_MOST_FLESH_M = 0.125
# From the hip joints back to the back of the body, and from ankle to heel with a little room.
_BACK_FLESH_M, _HEEL_M = 0.16, 0.11
# Where the surface is looked at, and how much higher than in its middle it may be.
_UNDER_AHEAD_M, _UNDER_ASIDE_M, _UNEVEN_M = np.linspace(-0.08, 0.2, 8), np.linspace(-0.16, 0.16, 7), 0.05
# The front of knees, shins and toes: ahead of the ankle, and above the floor; to either side; and the room they need.
_LEG_FRONT_M, _LEG_ASIDE_M, _LEG_ROOM_M = ((0.05, 0.45), (0.08, 0.25), (0.16, 0.08)), 0.13, 0.05
# Heels rise at most this far from the floor on a high seat, radians.
_MOST_HEEL_RAD = 0.42
_MOST_SINK_M = 0.018
_LEAN_DOWN_RAD, _LEAN_UP_RAD = 0.62, 0.72
_REST_LEANS_RAD = (-0.16, -0.08, 0.0, 0.08, 0.16, 0.24)
_PELVIS_TILT_RAD = -0.2


@dataclass(frozen=True)
class Sitting:
    """One sit: times in seconds, where hips and feet are, and the trunk's lean at rest.

    ``spot_m`` is where the body's axis stands (x, y) while feet are planted, ``hip_m`` the middle of the hip joints at
    rest, ``heel_rad`` how far the heels are raised then.
    """

    arrive_s: float
    down_s: float
    rise_s: float
    leave_s: float
    facing_rad: float
    spot_m: Float64[np.ndarray, "2"]
    hip_m: Float64[np.ndarray, "3"]
    heel_rad: float
    lean_rad: float


@dataclass(frozen=True)
class _Seat:
    """The surface from the sitter's side: height above the floor, distances to the front edge and to a backrest."""

    middle_m: Float64[np.ndarray, "3"]
    facing_rad: float
    floor_m: float
    edge_m: float
    backs: tuple[tuple[float, float], ...]

    @property
    def height_m(self) -> float:
        """Of the surface above the floor."""
        return float(self.middle_m[2] - self.floor_m)


def plan_sittings(route: Route, skeleton: Skeleton, room: Room, fps: float) -> tuple[Sitting, ...]:
    """The sits of a route; one that the body, the time or the seat does not allow is left out, and logged."""
    wanted = [dwell for dwell in route.dwells if dwell.purpose == "sit"]
    if not wanted:
        return ()
    caster = Caster(join([obj.mesh for obj in room.objects]))
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
        replace(dwell, purpose="look", target_m=_beyond(route, dwell))
        if dwell.purpose == "sit" and not any(abs(arrive_s - dwell.first_frame / fps) < 0.5 / fps for arrive_s in begun)
        else dwell
        for dwell in route.dwells
    )
    return replace(route, dwells=dwells)


def stepped_back(route: Route, sittings: tuple[Sitting, ...], fps: float) -> Route:
    """The route with the steps to each seat and away from it."""
    position_m, heading_rad = route.position_m.copy(), route.heading_rad.copy()
    time_s = np.arange(len(heading_rad)) / fps
    for sitting in sittings:
        weight = _stepping(sitting, time_s)
        position_m[:, :2] += weight[:, None] * (sitting.spot_m - position_m[:, :2])
        turn_rad = (sitting.facing_rad - heading_rad + np.pi) % (2.0 * np.pi) - np.pi
        heading_rad += weight * turn_rad
    return replace(route, position_m=position_m, heading_rad=heading_rad)


def seated_weight(sittings: tuple[Sitting, ...], time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """From 0 (standing) to 1 (sitting)."""
    weight = np.zeros(len(time_s))
    for sitting in sittings:
        weight = np.maximum(weight, one_seated_weight(sitting, time_s))
    return weight


def one_seated_weight(sitting: Sitting, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """From 0 (standing) to 1 (on this seat)."""
    return smoothstep((time_s - sitting.down_s) / DOWN_S) * (1.0 - smoothstep((time_s - sitting.rise_s) / UP_S))


def sitting_lean_rad(sittings: tuple[Sitting, ...], time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """The chest's lean: forward while hips go down and up, the backrest's at rest."""
    lean_rad = np.zeros(len(time_s))
    for sitting in sittings:
        for start_s, duration_s, most_rad in (
            (sitting.down_s - 0.1, DOWN_S + 0.2, _LEAN_DOWN_RAD),
            (sitting.rise_s - 0.25, UP_S + 0.35, _LEAN_UP_RAD),
        ):
            weight = np.clip((time_s - start_s) / duration_s, 0.0, 1.0)
            lean_rad += most_rad * np.sin(np.pi * weight) ** 2
        lean_rad += sitting.lean_rad * one_seated_weight(sitting, time_s) ** 2
    return lean_rad


def pelvis_tilt_rad(sittings: tuple[Sitting, ...], time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """How far the pelvis rolls back on the seat (negative)."""
    return _PELVIS_TILT_RAD * seated_weight(sittings, time_s) ** 3


def lowered_pelvis(
    sittings: tuple[Sitting, ...],
    pelvis_m: Float64[np.ndarray, "N 3"],
    world_from_pelvis: Float64[np.ndarray, "N 3 3"],
    skeleton: Skeleton,
    time_s: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, "N 3"]:
    """The pelvis of a standing body taken down to its seats; ``world_from_pelvis`` is the seated body's."""
    lowered_m = pelvis_m.copy()
    hips_m = 0.5 * (bone(skeleton, "pelvis", "left_hip") + bone(skeleton, "pelvis", "right_hip"))
    for sitting in sittings:
        weight = one_seated_weight(sitting, time_s)
        seated_m = sitting.hip_m - rotate(world_from_pelvis, hips_m)
        # Hips go down before they go back, as a leg reaches no farther.
        lowered_m[:, :2] += (weight**1.4)[:, None] * (seated_m - lowered_m)[:, :2]
        lowered_m[:, 2] += weight * (seated_m - lowered_m)[:, 2]
    return lowered_m


def raised_heels(
    track: FootTrack,
    sittings: tuple[Sitting, ...],
    toe_joint_m: Float64[np.ndarray, "3"],
    time_s: Float64[np.ndarray, " N"],
) -> FootTrack:
    """The track of a planted foot with its heel raised about the ball while its owner sits on a high seat."""
    pitch_rad = np.zeros(len(time_s))
    for sitting in sittings:
        pitch_rad += sitting.heel_rad * one_seated_weight(sitting, time_s) * track.on_floor
    if not pitch_rad.any():
        return track
    flat = about_z(track.yaw_rad)
    ankle_m = track.ankle_m + np.einsum("nij,j->ni", flat - flat @ about_y(pitch_rad), toe_joint_m)
    return replace(
        track,
        ankle_m=np.asarray(ankle_m),
        pitch_rad=track.pitch_rad + pitch_rad,
        heel_contact=track.heel_contact & (pitch_rad < 1e-9),
    )


def _plan(dwell: Dwell, route: Route, skeleton: Skeleton, caster: Caster, fps: float) -> Sitting | None:
    middle = (dwell.first_frame + dwell.last_frame) // 2
    standing_m = route.position_m[middle]
    seat = _look_at_seat(np.array(dwell.target_m), float(route.heading_rad[middle]), float(standing_m[2]), caster)
    place = _settle(seat, float(np.linalg.norm(standing_m[:2] - seat.middle_m[:2])), skeleton)
    if place is None:
        return None
    hip_m, ahead_m, heel_rad = place
    lean_rad = _rest_lean_rad(seat, hip_m, skeleton)
    times_s = _times_s(dwell, route, hip_m, ahead_m, seat.facing_rad, fps)
    if lean_rad is None or times_s is None or not _legs_fit(seat, hip_m, ahead_m, caster):
        return None
    ankle_ahead_m = float(bone(skeleton, "pelvis", "left_ankle")[0])
    spot_m = hip_m[:2] + (ahead_m - ankle_ahead_m) * _ahead(seat.facing_rad)
    return Sitting(*times_s, seat.facing_rad, spot_m, hip_m, heel_rad, lean_rad)


def _ahead(facing_rad: float) -> Float64[np.ndarray, "2"]:
    return np.array([np.cos(facing_rad), np.sin(facing_rad)])


def _look_at_seat(middle_m: Float64[np.ndarray, "3"], facing_rad: float, floor_m: float, caster: Caster) -> _Seat:
    ahead = np.append(_ahead(facing_rad), 0.0)
    middle_m = np.array([middle_m[0], middle_m[1], _highest_m(middle_m, ahead, caster)])
    steps_m = np.arange(0.04, 0.7, 0.01)
    from_m = middle_m + np.array([0.0, 0.0, 0.12]) + steps_m[:, None] * ahead
    depth_m = caster.first_hit(from_m, np.tile([0.0, 0.0, -1.0], (len(from_m), 1))).distance_m
    ends = depth_m > 0.27
    levels_m = np.array([0.14, 0.24, 0.34, 0.44, 0.54])
    behind = caster.first_hit(
        middle_m + levels_m[:, None] * np.array([0.0, 0.0, 1.0]), np.tile(-ahead, (len(levels_m), 1))
    )
    edge_m = float(steps_m[ends.argmax()]) if ends.any() else float(steps_m[-1])
    backs = tuple(zip(levels_m.tolist(), behind.distance_m.tolist(), strict=True))
    return _Seat(middle_m, facing_rad, floor_m, edge_m, backs)


def _highest_m(middle_m: Float64[np.ndarray, "3"], ahead: Float64[np.ndarray, "3"], caster: Caster) -> float:
    """The height of the surface under the hips and thighs where it is highest: beds have folds."""
    left = np.array([-ahead[1], ahead[0], 0.0])
    forward_m, aside_m = (grid.reshape(-1, 1) for grid in np.meshgrid(_UNDER_AHEAD_M, _UNDER_ASIDE_M))
    from_m = middle_m + forward_m * ahead + aside_m * left + np.array([0.0, 0.0, _UNEVEN_M])
    depth_m = caster.first_hit(from_m, np.tile([0.0, 0.0, -1.0], (len(from_m), 1))).distance_m
    return float(middle_m[2] + max(_UNEVEN_M - depth_m.min(), 0.0))


def _settle(seat: _Seat, standing_m: float, skeleton: Skeleton) -> tuple[Float64[np.ndarray, "3"], float, float] | None:
    """Where the hips come to rest, how far the ankles are ahead of them, and how far heels are raised."""
    leg, foot = leg_of(skeleton, "left"), foot_of(skeleton, "left")
    thigh_m, shin_m = float(np.linalg.norm(leg.thigh_m)), float(np.linalg.norm(leg.shin_m))
    flesh_m = (_FLESH_FRACTION * thigh_m if skeleton.seat_m is None else skeleton.seat_m) - _GIVE_M
    if flesh_m > _MOST_FLESH_M:
        return None
    nearest_back_m = min(distance_m for _, distance_m in seat.backs)
    best: tuple[float, float, float, float] | None = None
    for shift_m in np.arange(max(0.0, _BACK_FLESH_M - nearest_back_m), max(seat.edge_m - 0.09, 0.01), 0.02):
        edge_m = seat.edge_m - shift_m
        nearest_m = edge_m + _HEEL_M
        for ahead_m in np.linspace(nearest_m, max(nearest_m, thigh_m + 0.08), 4):
            for heel_rad in np.arange(0.0, _MOST_HEEL_RAD + 0.01, 0.07):
                ankle_m = foot.ankle_height_m + float(np.sin(heel_rad)) * float(foot.toe_joint_m[0])
                sink_m = _sink_m(seat.height_m, flesh_m, edge_m, ahead_m, ankle_m, thigh_m, shin_m)
                discomfort = 0.5 * shift_m + 0.3 * heel_rad + 0.2 * abs(ahead_m - min(standing_m + shift_m, thigh_m))
                cost = discomfort + 60.0 * max(0.0, sink_m - 0.005)
                if sink_m < _MOST_SINK_M and (best is None or cost < best[0]):
                    best = (cost, float(shift_m), float(ahead_m), float(heel_rad))
    if best is None:
        return None
    _, shift_m, ahead_m, heel_rad = best
    hip_xy_m = seat.middle_m[:2] + shift_m * _ahead(seat.facing_rad)
    return np.array([*hip_xy_m, seat.middle_m[2] + flesh_m]), ahead_m, heel_rad


def _sink_m(
    seat_m: float, flesh_m: float, edge_m: float, ahead_m: float, ankle_m: float, thigh_m: float, shin_m: float
) -> float:
    """How far the thigh is below the seat at its front edge; infinite where the leg does not reach."""
    hip = np.array([0.0, seat_m + flesh_m])
    gap = np.array([ahead_m, ankle_m]) - hip
    reach_m = float(np.linalg.norm(gap))
    if reach_m > 0.99 * (thigh_m + shin_m):
        return float("inf")
    cosine = (thigh_m**2 + reach_m**2 - shin_m**2) / (2.0 * thigh_m * reach_m)
    angle_rad = np.arctan2(gap[1], gap[0]) + np.arccos(np.clip(cosine, -1.0, 1.0))
    knee = hip + thigh_m * np.array([np.cos(angle_rad), np.sin(angle_rad)])
    if knee[0] < edge_m:
        return float("inf")
    bone_m = hip[1] + (knee[1] - hip[1]) * edge_m / knee[0]
    return float(seat_m - (bone_m - _THIGH_FRACTION * flesh_m))


def _legs_fit(seat: _Seat, hip_m: Float64[np.ndarray, "3"], ahead_m: float, caster: Caster) -> bool:
    """Whether nothing stands where knees, shins and toes come to be."""
    ahead = _ahead(seat.facing_rad)
    left = np.array([-ahead[1], ahead[0]])
    front_m = [
        np.append(hip_m[:2] + (ahead_m + forward_m) * ahead + aside_m * left, seat.floor_m + height_m)
        for forward_m, height_m in _LEG_FRONT_M
        for aside_m in (-_LEG_ASIDE_M, _LEG_ASIDE_M)
    ]
    return bool(caster.closest_distance(np.array(front_m), 2.0 * _LEG_ROOM_M).min() >= _LEG_ROOM_M)


def _rest_lean_rad(seat: _Seat, hip_m: Float64[np.ndarray, "3"], skeleton: Skeleton) -> float | None:
    """The first lean at which the back stays clear of the backrest; None where the body does not fit at all."""
    forward_m = float((hip_m[:2] - seat.middle_m[:2]) @ _ahead(seat.facing_rad))
    rise_m = float(hip_m[2] - seat.middle_m[2])
    leans_rad = _REST_LEANS_RAD if min(distance_m for _, distance_m in seat.backs) < 0.5 else _REST_LEANS_RAD[1:]
    for lean_rad in leans_rad:
        gaps_m = [
            distance_m + forward_m + np.tan(lean_rad) * max(level_m - rise_m, 0.0) - _BACK_FLESH_M
            for level_m, distance_m in seat.backs
        ]
        if min(gaps_m) >= 0.0:
            return lean_rad
    return None


def _times_s(
    dwell: Dwell, route: Route, hip_m: Float64[np.ndarray, "3"], ahead_m: float, facing_rad: float, fps: float
) -> tuple[float, float, float, float] | None:
    """When it arrives, goes down, rises and leaves; a dwell at an end of the route is sat out there."""
    arrive_s, leave_s = dwell.first_frame / fps, dwell.last_frame / fps
    standing_m = route.position_m[(dwell.first_frame + dwell.last_frame) // 2, :2]
    step_m = float(np.linalg.norm(hip_m[:2] + ahead_m * _ahead(facing_rad) - standing_m))
    step_s = max(_LEAST_BACK_S, step_m / _BACK_STEP_MPS) if step_m > 0.04 else 0.0
    last = dwell.last_frame >= len(route.heading_rad) - 1
    down_s = arrive_s + step_s + _SETTLE_S if dwell.first_frame > 0 else arrive_s - 20.0
    rise_s = leave_s - step_s - _SETTLE_S - UP_S if not last else leave_s + 20.0
    if rise_s - (down_s + DOWN_S) < _LEAST_REST_S:
        return None
    return arrive_s, down_s, rise_s, leave_s


def _stepping(sitting: Sitting, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """From 0 (on the route) to 1 (on the spot before the seat)."""
    there_s, back_s = sitting.down_s - _SETTLE_S, sitting.rise_s + UP_S + _SETTLE_S
    weight = np.ones(len(time_s))
    if sitting.arrive_s < sitting.down_s:
        weight = smoothstep((time_s - sitting.arrive_s) / max(there_s - sitting.arrive_s, 1e-3))
    if sitting.leave_s > sitting.rise_s:
        weight = weight * (1.0 - smoothstep((time_s - back_s) / max(sitting.leave_s - back_s, 1e-3)))
    return np.asarray(weight)


def _beyond(route: Route, dwell: Dwell) -> tuple[float, float, float]:
    """A place in front of the actor at eye height."""
    middle = (dwell.first_frame + dwell.last_frame) // 2
    x_m, y_m, z_m = route.position_m[middle]
    ahead = _ahead(float(route.heading_rad[middle]) + 0.4)
    return float(x_m + 3.0 * ahead[0]), float(y_m + 3.0 * ahead[1]), float(z_m + 1.3)
