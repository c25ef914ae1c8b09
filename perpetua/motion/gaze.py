"""What a person looks and points at: what a pause is about, or an object that words name."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.motion.actions import mentioned_words, names
from perpetua.motion.rotations import smoothstep
from perpetua.scene.actor import Route
from perpetua.scene.room import Room

# Eyes turn to what a pause is about in this time, and a little before it begins.
_TURN_S, _EARLY_S = 0.7, 0.3
_FARTHEST_RAD, _STEEPEST_RAD = 1.25, 0.8
# What people point at where words name nothing that is there.
_WORTH_POINTING_AT = frozenset(
    (
        "bookshelf",
        "shelf",
        "window",
        "picture",
        "painting",
        "mirror",
        "tv",
        "television",
        "plant",
        "cabinet",
        "wardrobe",
    )
)
# An object is pointed at from within these angles of straight ahead: to the arm's own side and to the other.
_OWN_SIDE_RAD, _OTHER_SIDE_RAD = 1.3, 0.3


@dataclass(frozen=True)
class Gaze:
    """Where something of interest is, relative to the heading; ``weight`` (0 to 1) is how much it is looked at."""

    weight: Float64[np.ndarray, " N"]
    yaw_rad: Float64[np.ndarray, " N"]
    pitch_rad: Float64[np.ndarray, " N"]


def dwell_gaze(
    route: Route,
    fps: float,
    eye_m: Float64[np.ndarray, "N 3"],
    heading_rad: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Gaze:
    """Looking at what each pause of a route is about; nobody looks at the seat they sit on."""
    weight, yaw_rad, pitch_rad = (np.zeros(len(time_s)) for _ in range(3))
    for dwell in route.dwells:
        if dwell.purpose == "sit":
            continue
        start_s, end_s = dwell.first_frame / fps - _EARLY_S, dwell.last_frame / fps
        look = smoothstep((time_s - start_s) / _TURN_S) * (1.0 - smoothstep((time_s - end_s + _TURN_S) / _TURN_S))
        one_yaw_rad, one_pitch_rad = _towards(np.array(dwell.target_m), eye_m, heading_rad)
        stronger = look > weight
        weight, yaw_rad, pitch_rad = (
            np.where(stronger, new, old)
            for new, old in ((look, weight), (one_yaw_rad, yaw_rad), (one_pitch_rad, pitch_rad))
        )
    # What is behind cannot be looked at without turning round.
    weight = weight * (1.0 - smoothstep((np.abs(yaw_rad) - 1.6) / 0.6))
    return Gaze(
        weight,
        np.clip(yaw_rad, -_FARTHEST_RAD, _FARTHEST_RAD),
        np.clip(pitch_rad, -_STEEPEST_RAD, _STEEPEST_RAD),
    )


def aim_m(route: Route, room: Room, fps: float, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3"]:
    """What is pointed at over time, in the world; NaN where there is nothing.

    It is what the nearest pause is about, else an object that the words name, or one like it.
    """
    target_m = np.tile(_object_m(route, room), (len(time_s), 1))
    looks = [dwell for dwell in route.dwells if dwell.purpose == "look"]
    if looks:
        middles_s = np.array([0.5 * (dwell.first_frame + dwell.last_frame) / fps for dwell in looks])
        nearest = np.abs(time_s[:, None] - middles_s).argmin(axis=1)
        target_m = np.array([dwell.target_m for dwell in looks])[nearest]
    return np.asarray(target_m, np.float64)


def aim_weight(
    side: str,
    target_m: Float64[np.ndarray, "N 3"],
    eye_m: Float64[np.ndarray, "N 3"],
    heading_rad: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    """From 0 (behind) to 1 (in front): whether the left or right hand can point at a target."""
    yaw_rad, _ = _towards(target_m, eye_m, heading_rad)
    outward_rad = yaw_rad if side == "left" else -yaw_rad
    too_far = np.maximum((outward_rad - _OWN_SIDE_RAD) / 0.5, (-outward_rad - _OTHER_SIDE_RAD) / 0.5)
    return 1.0 - smoothstep(too_far)


def _object_m(route: Route, room: Room) -> Float64[np.ndarray, "3"]:
    stems = mentioned_words(route.description)
    middle_m = route.position_m[len(route.position_m) // 2]
    solid = [obj for obj in room.objects if not obj.walkable and len(obj.mesh.vertices_m) > 0]
    named = [obj for obj in solid if names(stems, obj.category)]
    chosen = named or [obj for obj in solid if obj.category in _WORTH_POINTING_AT]
    if not chosen:
        return np.full(3, np.nan)
    centres_m = np.array([0.5 * (obj.mesh.vertices_m.min(0) + obj.mesh.vertices_m.max(0)) for obj in chosen])
    return np.asarray(centres_m[np.linalg.norm(centres_m - middle_m, axis=1).argmin()])


def _towards(
    target_m: Float64[np.ndarray, "*N 3"], eye_m: Float64[np.ndarray, "N 3"], heading_rad: Float64[np.ndarray, " N"]
) -> tuple[Float64[np.ndarray, " N"], Float64[np.ndarray, " N"]]:
    away_m = target_m - eye_m
    yaw_rad = np.arctan2(away_m[:, 1], away_m[:, 0]) - heading_rad
    yaw_rad = (yaw_rad + np.pi) % (2.0 * np.pi) - np.pi
    return yaw_rad, np.arctan2(-away_m[:, 2], np.linalg.norm(away_m[:, :2], axis=1))
