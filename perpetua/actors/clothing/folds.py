"""Folds of worn cloth: where garments hang, are pulled, and are pushed together."""

import numpy as np
from jaxtyping import Float64

from perpetua.actors.base.wearer import along_arm_m, along_leg_m

Places = Float64[np.ndarray, "P 3"]
Values = Float64[np.ndarray, " P"]

# On the base mesh: where sleeves are set in under the arm, and where the legs part.
_ARMPIT_M = np.array([0.02, 0.165, 0.385])
_CROTCH_M = np.array([0.05, 0.0, -0.045])


def _noise(template_m: Places, wave_m: float, rng: np.random.Generator) -> Values:
    """Smooth noise of about unit deviation whose features are ``wave_m`` apart."""
    total = np.zeros(len(template_m))
    for _ in range(7):
        direction = rng.standard_normal(3)
        direction *= 2.0 * np.pi / (wave_m * rng.uniform(0.7, 1.4) * np.linalg.norm(direction))
        total += np.sin(template_m @ direction + rng.uniform(0.0, 2.0 * np.pi))
    return total / np.sqrt(3.5)


def _ridges(phase: Values) -> Values:
    """Folds: narrow crests between wide troughs, with mean 0."""
    return np.asarray(2.0 * (0.5 + 0.5 * np.cos(phase)) ** 1.7 - 0.82)


def _uneven(template_m: Places, rng: np.random.Generator) -> Values:
    """How strong folds are here, 0 to about 1.3: none is as deep along its whole length."""
    return np.clip(0.65 + 0.4 * _noise(template_m, 0.16, rng), 0.0, 1.3)


def _azimuth_rad(template_m: Places, centre_m: Float64[np.ndarray, "3"]) -> Values:
    return np.arctan2(template_m[:, 1] - centre_m[1], template_m[:, 0] - centre_m[0])


def _fan(
    template_m: Places, start_m: Float64[np.ndarray, "3"], folds: float, reach_m: float, rng: np.random.Generator
) -> Values:
    """Folds that spread from a place where cloth is pulled, the same on both sides."""
    from_start = template_m * np.array([1.0, np.sign(start_m[1]) if start_m[1] else 1.0, 1.0]) - start_m
    distance = np.linalg.norm(from_start, axis=1)
    angle = np.arctan2(from_start[:, 2], np.abs(from_start[:, 1]) + 0.3 * from_start[:, 0])
    phase = folds * angle + 1.2 * _noise(template_m, 0.25, rng) + rng.uniform(0.0, 2.0 * np.pi)
    near = np.clip(distance / 0.04, 0.0, 1.0) * np.exp(-((distance / reach_m) ** 2))
    return np.asarray(_ridges(phase) * near)


def _rings(template_m: Places, along_m: Values, wave_m: float, rng: np.random.Generator) -> Values:
    """Folds around a limb, aslant and not closed."""
    slant = 1.4 * np.sin(_azimuth_rad(template_m, np.zeros(3)) + rng.uniform(0.0, 2.0 * np.pi))
    phase = 2.0 * np.pi * along_m / wave_m + slant + 1.5 * _noise(template_m, 0.14, rng)
    return _ridges(phase + rng.uniform(0.0, 2.0 * np.pi))


def top_folds(template_m: Places, arm: Values, long_sleeves: bool, rng: np.random.Generator) -> Values:
    """Folds of a top, about -1 to 1: it hangs from the chest, is pulled under the arms and pushed up at the elbows.

    Args:
        template_m: places on the base mesh.
        arm: how much each belongs to an arm, 0 to 1.
        long_sleeves: whether sleeves cover the elbows.
    """
    height = template_m[:, 2]
    hanging = _ridges(
        _azimuth_rad(template_m, np.array([0.04, 0.0, 0.0])) * rng.uniform(8.0, 11.0)
        + 1.3 * _noise(template_m, 0.30, rng)
        + rng.uniform(-6.0, 6.0) * height
    ) * np.interp(height, [0.0, 0.10, 0.30, 0.40], [1.0, 0.75, 0.35, 0.0])
    slumped = _rings(template_m, height, 0.075, rng) * np.interp(
        height, [0.05, 0.12, 0.20, 0.30], [0.0, 0.55, 0.45, 0.0]
    )
    mirrored_m = np.stack([template_m[:, 0], np.abs(template_m[:, 1]), height], axis=1)
    pulled = 0.6 * _fan(mirrored_m, _ARMPIT_M, 6.0, 0.11, rng)
    body = (hanging + slumped) * _uneven(template_m, rng) + pulled
    along = along_arm_m(template_m)
    crooked = np.interp(along, [0.05, 0.16, 0.25, 0.34, 0.42], [0.15, 0.5, 1.0, 0.7, 0.55]) if long_sleeves else 0.25
    sleeve = _rings(template_m, along, 0.055, rng) * crooked * _uneven(template_m, rng) + 0.6 * pulled
    return np.asarray((1.0 - arm) * body + arm * sleeve)


def trouser_folds(template_m: Places, rng: np.random.Generator) -> Values:
    """Folds of trousers, about -1 to 1: pulled at the crotch, pushed together at knees and ankles."""
    below = along_leg_m(template_m)
    side = np.where(template_m[:, 1] > 0, 1.0, -1.0)
    pulled = 0.7 * _fan(template_m, _CROTCH_M, 6.0, 0.15, rng)
    knees = np.interp(below, [0.26, 0.36, 0.44, 0.56], [0.0, 0.55, 0.6, 0.0])
    ankles = np.interp(below, [0.56, 0.68, 0.77, 0.84], [0.0, 0.7, 1.0, 0.5])
    pushed = _rings(template_m + 0.31 * side[:, None], below, 0.062, rng) * (knees + ankles)
    long_ones = 0.35 * _ridges(
        _azimuth_rad(template_m - np.array([0.0, 0.1, 0.0]) * side[:, None], np.zeros(3)) * 4.0
        + 1.5 * _noise(template_m, 0.35, rng)
    )
    down = np.interp(below, [0.0, 0.1], [0.0, 1.0])
    return np.asarray(pulled + (pushed + long_ones * down) * _uneven(template_m, rng))


def skirt_folds(template_m: Places, hem_z_m: float, rng: np.random.Generator) -> Values:
    """Folds of a skirt, about -1 to 1, deeper towards the hem."""
    azimuth_rad = _azimuth_rad(template_m, np.array([0.02, 0.0, 0.0]))
    phase = azimuth_rad * float(rng.integers(9, 14)) + 0.9 * _noise(template_m, 0.35, rng)
    return np.asarray(_ridges(phase) * np.interp(template_m[:, 2], [hem_z_m, -0.05, 0.06], [1.0, 0.35, 0.0]))
