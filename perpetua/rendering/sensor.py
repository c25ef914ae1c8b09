"""How a view's camera differs from an ideal one: exposure and white balance of its own, and noise. Geometry stays."""

import math

import numpy as np
from jaxtyping import Float64
from pydantic import Field

from perpetua.io.section import Section
from perpetua.seeding import StageSeed

# Sines that exposure drifts in.
DRIFT_WAVES = 3


class SensorConfig(Section):
    """Deviations of the cameras; all are off by default."""

    shot_noise: float = Field(
        0.0, ge=0.0, le=1.0, description="noise of counted light, as standard deviation where the picture is white"
    )
    read_noise: float = Field(
        0.0, ge=0.0, le=1.0, description="noise of reading the sensor, as standard deviation; 1 is white"
    )
    exposure_spread_ev: float = Field(
        0.0, ge=0.0, le=3.0, description="standard deviation between views of their exposure, stops"
    )
    exposure_drift_ev: float = Field(
        0.0, ge=0.0, le=3.0, description="standard deviation over time of a view's exposure, stops; 0: constant"
    )
    balance_spread: float = Field(
        0.0, ge=0.0, le=0.5, description="standard deviation between views of red and blue against green, as a share"
    )


def view_gains(config: SensorConfig, camera: int, frames: int, seed: StageSeed) -> Float64[np.ndarray, "T 3"] | None:
    """Factors of red, green and blue that one view's camera has beside the room's exposure and white balance.

    Args:
        config: how much cameras differ.
        camera: the view's number.
        frames: length of the sequence.
        seed: of the render stage; each kind of deviation has a stream of its own.

    Returns:
        Gains in linear light, or None where the camera is ideal.
    """
    if config.exposure_spread_ev == config.exposure_drift_ev == config.balance_spread == 0.0:
        return None
    offset_ev = config.exposure_spread_ev * float(seed.stream("exposure", camera).standard_normal())
    stops = offset_ev + config.exposure_drift_ev * _drift(frames, seed.stream("drift", camera))
    red, blue = config.balance_spread * seed.stream("balance", camera).standard_normal(2)
    return np.asarray(2.0 ** stops[:, None] * np.exp([red, 0.0, blue]))


def _drift(frames: int, draw: np.random.Generator) -> Float64[np.ndarray, " T"]:
    """A slow wave with variance 1: the sum of few sines with random phases."""
    time = np.linspace(0.0, 1.0, frames)
    periods = draw.uniform(0.5, 2.5, (DRIFT_WAVES, 1))
    phase = draw.uniform(0.0, 2.0 * math.pi, (DRIFT_WAVES, 1))
    waves = np.sin(2.0 * math.pi * periods * time + phase)
    return np.asarray(waves.sum(axis=0) * math.sqrt(2.0 / DRIFT_WAVES))


def noise_seed(seed: StageSeed) -> int:
    """What the worker seeds each picture's noise with, beside the numbers of view and frame."""
    return int(seed.stream("noise").integers(1 << 31))
