"""Where hips and feet come to rest on a seat."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.legs import foot_of, leg_of
from perpetua.scene.actor import Seat, Skeleton

# Flesh between the hip joints and the seat, in lengths of the thigh, where the body does not say.
_FLESH_FRACTION = 0.235
# Under the thigh there is less of it, and a cushion gives way by so much.
_THIGH_FRACTION, _GIVE_M = 0.85, 0.003
# Skirts that hang lower than this would hang through the seat.
_MOST_FLESH_M = 0.125
# From the hip joints back to the back of the body, and from ankle to heel with a little room.
BACK_FLESH_M, _HEEL_M = 0.16, 0.11
# Hips rest at least this far behind the front edge.
_LEAST_TO_EDGE_M = 0.09
# Heels rise at most this far from the floor on a high seat, radians.
_MOST_HEEL_RAD = 0.42
_MOST_SINK_M = 0.018


@dataclass(frozen=True)
class SeatedPose:
    """A body at rest on a seat.

    ``hip_m`` is the middle of the hip joints in the world, ``ahead_m`` how far the ankles are ahead of it,
    ``heel_rad`` how far the heels are raised.
    """

    hip_m: Float64[np.ndarray, "3"]
    ahead_m: float
    heel_rad: float


@dataclass(frozen=True)
class _Legs:
    """What of a body decides how it sits: ``flesh_m`` is between the hip joints and the seat."""

    thigh_m: float
    shin_m: float
    flesh_m: float
    ankle_height_m: float
    toe_ahead_m: float


@dataclass(frozen=True)
class _Choice:
    """Hips moved forward by ``shift_m``, feet ``ahead_m`` of them, heels raised by ``heel_rad``."""

    shift_m: float
    ahead_m: float
    heel_rad: float


def ahead_of(facing_rad: float) -> Float64[np.ndarray, "2"]:
    """The direction (x, y) that faces this way."""
    return np.array([np.cos(facing_rad), np.sin(facing_rad)])


def settle(seat: Seat, standing_m: Float64[np.ndarray, "3"], skeleton: Skeleton) -> SeatedPose | None:
    """The most comfortable pose on a seat; None where the body does not fit it.

    Args:
        seat: what is sat on.
        standing_m: where the body stands before it sits down, on the floor.
        skeleton: its bones.
    """
    legs = _legs(skeleton)
    if legs.flesh_m > _MOST_FLESH_M:
        return None
    before_m = float(np.linalg.norm(standing_m[:2] - np.array(seat.middle_m[:2])))
    best, least = None, np.inf
    for choice in _choices(seat, legs):
        sink_m = _sink_m(seat.top_m - float(standing_m[2]), seat.edge_m - choice.shift_m, legs, choice)
        cost = _discomfort(choice, before_m, legs) + 60.0 * max(0.0, sink_m - 0.005)
        if sink_m < _MOST_SINK_M and cost < least:
            best, least = choice, cost
    if best is None:
        return None
    hip_xy_m = np.array(seat.middle_m[:2]) + best.shift_m * ahead_of(seat.facing_rad)
    return SeatedPose(np.array([*hip_xy_m, seat.top_m + legs.flesh_m]), best.ahead_m, best.heel_rad)


def _legs(skeleton: Skeleton) -> _Legs:
    leg, foot = leg_of(skeleton, "left"), foot_of(skeleton, "left")
    thigh_m = float(np.linalg.norm(leg.thigh_m))
    flesh_m = (_FLESH_FRACTION * thigh_m if skeleton.seat_m is None else skeleton.seat_m) - _GIVE_M
    shin_m = float(np.linalg.norm(leg.shin_m))
    return _Legs(thigh_m, shin_m, flesh_m, foot.ankle_height_m, float(foot.toe_joint_m[0]))


def _choices(seat: Seat, legs: _Legs) -> Iterator[_Choice]:
    """Poses on a grid: hips clear of the backrest, feet in front of the seat."""
    nearest_back_m = min(distance_m for _, distance_m in seat.backs_m)
    first_m, last_m = max(0.0, BACK_FLESH_M - nearest_back_m), max(seat.edge_m - _LEAST_TO_EDGE_M, 0.01)
    for shift_m in np.arange(first_m, last_m, 0.02):
        nearest_m = seat.edge_m - shift_m + _HEEL_M
        for ahead_m in np.linspace(nearest_m, max(nearest_m, legs.thigh_m + 0.08), 4):
            for heel_rad in np.arange(0.0, _MOST_HEEL_RAD + 0.01, 0.07):
                yield _Choice(float(shift_m), float(ahead_m), float(heel_rad))


def _discomfort(choice: _Choice, before_m: float, legs: _Legs) -> float:
    """Hips far forward, raised heels, and feet far from where they stood or from under the knees."""
    feet_m = abs(choice.ahead_m - min(before_m + choice.shift_m, legs.thigh_m))
    return 0.5 * choice.shift_m + 0.3 * choice.heel_rad + 0.2 * feet_m


def _sink_m(height_m: float, edge_m: float, legs: _Legs, choice: _Choice) -> float:
    """How far the thigh is below the seat at its front edge; infinite where the leg does not reach.

    ``height_m`` is the seat's above the floor, ``edge_m`` how far its edge is ahead of the hips.
    """
    hip = np.array([0.0, height_m + legs.flesh_m])
    ankle_m = legs.ankle_height_m + float(np.sin(choice.heel_rad)) * legs.toe_ahead_m
    gap = np.array([choice.ahead_m, ankle_m]) - hip
    reach_m = float(np.linalg.norm(gap))
    if reach_m > 0.99 * (legs.thigh_m + legs.shin_m):
        return float("inf")
    cosine = (legs.thigh_m**2 + reach_m**2 - legs.shin_m**2) / (2.0 * legs.thigh_m * reach_m)
    angle_rad = np.arctan2(gap[1], gap[0]) + np.arccos(np.clip(cosine, -1.0, 1.0))
    knee = hip + legs.thigh_m * np.array([np.cos(angle_rad), np.sin(angle_rad)])
    if knee[0] < edge_m:
        return float("inf")
    bone_m = hip[1] + (knee[1] - hip[1]) * edge_m / knee[0]
    return float(height_m - (bone_m - _THIGH_FRACTION * legs.flesh_m))
