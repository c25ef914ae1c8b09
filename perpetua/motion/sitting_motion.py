"""What planned sits ask of the route, the trunk, the pelvis and the feet over time."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from perpetua.motion.feet import FootTrack
from perpetua.motion.kinematics import bone
from perpetua.motion.rotations import about_y, about_z, rotate, smoothstep
from perpetua.motion.sitting import DOWN_S, SETTLE_S, UP_S, Sitting
from perpetua.scene.actor import Route, Skeleton

# How far the chest leans forward on the way down and up, and the pelvis rolls back on the seat.
_LEAN_DOWN_RAD, _LEAN_UP_RAD = 0.62, 0.72
_PELVIS_TILT_RAD = -0.2


def stepped_back(route: Route, sittings: tuple[Sitting, ...], fps: float) -> Route:
    """The route with the steps to each seat and away from it."""
    position_m, heading_rad = route.position_m.copy(), route.heading_rad.copy()
    time_s = np.arange(len(heading_rad)) / fps
    for sitting in sittings:
        weight = _stepping(sitting, time_s)
        position_m[:, :2] += weight[:, None] * (sitting.axis_m - position_m[:, :2])
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
            fraction = np.clip((time_s - start_s) / duration_s, 0.0, 1.0)
            lean_rad += most_rad * np.sin(np.pi * fraction) ** 2
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


def _stepping(sitting: Sitting, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """From 0 (on the route) to 1 (standing before the seat)."""
    there_s, back_s = sitting.down_s - SETTLE_S, sitting.rise_s + UP_S + SETTLE_S
    weight = np.ones(len(time_s))
    if sitting.arrive_s < sitting.down_s:
        weight = smoothstep((time_s - sitting.arrive_s) / max(there_s - sitting.arrive_s, 1e-3))
    if sitting.leave_s > sitting.rise_s:
        weight = weight * (1.0 - smoothstep((time_s - back_s) / max(sitting.leave_s - back_s, 1e-3)))
    return np.asarray(weight)
