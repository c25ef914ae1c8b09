"""How high the hips are when no leg pulls them down: the floor, the pace, and a jogger's bounce."""

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.footsteps import Plant
from perpetua.motion.kinematics import joint_index
from perpetua.motion.path import RoutePath
from perpetua.scene.actor import Skeleton

# Share of the leg by which the pelvis stands lower than with straight legs: at rest, more when walking and running.
_STANDING_DROP, _WALKING_DROP, _RUNNING_DROP = 0.008, 0.008, 0.075
# A jogger's hips go up and down by this fraction of the leg about their mean.
_BOUNCE = 0.055
_FLOOR_SOFTNESS_S = 0.12


def nominal_height_m(
    path: RoutePath,
    skeleton: Skeleton,
    plants: tuple[tuple[Plant, ...], tuple[Plant, ...]],
    reach_m: float,
    drop: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, " N"]:
    """Height of the pelvis joint at evenly spaced times.

    Args:
        path: the route.
        skeleton: the bones.
        plants: both feet on the floor.
        reach_m: length of the stretched leg.
        drop: how far actions bend the knees, lengths of the leg.
        time_s: evenly spaced times.
    """
    pace = np.clip(path.speed_mps(time_s) / 1.0, 0.0, 1.0)
    run = path.run_weight(time_s)
    drop_m = (_STANDING_DROP + _WALKING_DROP * pace + _RUNNING_DROP * run + drop) * reach_m
    sole_m = float(skeleton.contact_m[:, 2].min())
    straight_m = float(skeleton.joint_m[joint_index("pelvis"), 2]) - sole_m
    return _floor_m(plants, time_s) + straight_m - drop_m + _BOUNCE * reach_m * run * _bounce(plants, time_s)


def _floor_m(
    plants: tuple[tuple[Plant, ...], tuple[Plant, ...]], time_s: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, " N"]:
    """The floor between both feet."""
    step_s = float(time_s[1] - time_s[0])
    feet_m = [np.array([step.position_m[2] for step in steps])[_latest(steps, time_s)] for steps in plants]
    return np.asarray(gaussian_filter1d(0.5 * (feet_m[0] + feet_m[1]), _FLOOR_SOFTNESS_S / step_s, mode="nearest"))


def _latest(steps: tuple[Plant, ...], time_s: Float64[np.ndarray, " N"]) -> np.ndarray:
    return np.maximum(np.searchsorted([step.land_s for step in steps], time_s, side="right") - 1, 0)


def _bounce(
    plants: tuple[tuple[Plant, ...], tuple[Plant, ...]], time_s: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, " N"]:
    """Lowest (-1) in the middle of each stance, highest (1) half way to the next."""
    middles_s = np.sort(
        [
            0.5 * (step.land_s + step.lift_s)
            for steps in plants
            for step in steps
            if np.isfinite(step.land_s + step.lift_s)
        ]
    )
    if len(middles_s) < 2:
        return np.zeros(len(time_s))
    phase = np.interp(time_s, middles_s, np.arange(len(middles_s), dtype=np.float64))
    return np.asarray(-np.cos(2.0 * np.pi * phase))
