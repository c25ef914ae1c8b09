"""What each view is to be like: lens, framing, height, way of moving and direction, drawn from the seed."""

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from jaxtyping import Float64

from perpetua.cameras.bodies import BODY_LEVELS
from perpetua.cameras.config import CamerasConfig, Framing, Height, Style
from perpetua.seeding import StageSeed

Option = TypeVar("Option")
SWAY_HARMONICS = 3
SWAY_HZ = (0.3, 1.6)


@dataclass(frozen=True)
class FramingWish:
    """How an actor is framed.

    Projected height over the image's height, how many body points from the head down show, and which part of the
    configured range of lenses, from its narrowest (0) to its widest (1), serves that: a close view from close by
    would be crowded.
    """

    least_size: float
    most_size: float
    points: int
    lens: tuple[float, float]


@dataclass(frozen=True)
class StyleWish:
    """How a view moves: typical speed, how radial (towards the focus), tangential or along with it, share of sway."""

    least_mps: float
    most_mps: float
    radial: float
    tangential: float
    along: float
    sway: float


FRAMINGS: dict[Framing, FramingWish] = {
    "close": FramingWish(0.65, 1.10, 2, (0.0, 0.4)),
    "medium": FramingWish(0.42, 0.75, 4, (0.3, 0.75)),
    "wide": FramingWish(0.25, 0.50, 5, (0.65, 1.0)),
}
STYLES: dict[Style, StyleWish] = {
    "dolly": StyleWish(0.20, 0.40, 0.6, 0.0, 0.0, 0.15),
    "orbit": StyleWish(0.30, 0.60, 0.0, 0.8, 0.0, 0.15),
    "handheld": StyleWish(0.20, 0.45, 0.0, 0.0, 0.0, 1.0),
    "walk_along": StyleWish(0.35, 0.75, 0.0, 0.0, 0.8, 0.6),
    "static": StyleWish(0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
}


@dataclass(frozen=True)
class Sway:
    """Hand-held sway as a sum of sines: three positions (metres), then yaw, pitch and roll (radians)."""

    amplitude: Float64[np.ndarray, "6 H"]
    frequency_hz: Float64[np.ndarray, "6 H"]
    phase_rad: Float64[np.ndarray, "6 H"]

    def at(self, times_s: Float64[np.ndarray, " T"]) -> Float64[np.ndarray, "T 6"]:
        """The sway at given times."""
        angle = 2.0 * np.pi * self.frequency_hz * times_s[:, None, None] + self.phase_rad
        return np.asarray((self.amplitude * np.sin(angle)).sum(axis=-1))


@dataclass(frozen=True)
class ViewWish:
    """Everything one view of one candidate aims at but its focus; ``azimuth_rad`` is its direction from the actors."""

    camera: int
    fov_rad: float
    framing: FramingWish
    grouping: Framing
    style: StyleWish
    height_m: tuple[float, float]
    speed_mps: float
    azimuth_rad: float
    sway: Sway


def draw_wishes(
    seed: StageSeed,
    redraw: int,
    candidate: int,
    room_height_m: float,
    config: CamerasConfig,
) -> tuple[ViewWish, ...]:
    """One candidate's wishes. Views are spread evenly around the actors, each at another height."""
    shared = seed.stream("wishes", redraw, candidate)
    start_azimuth_rad = shared.uniform(0.0, 2.0 * np.pi)
    framings = _deal(shared, config.framings, config.count)
    heights = _deal(shared, config.heights, config.count)
    styles = _deal(shared, config.styles, config.count)
    wishes = []
    for camera in range(config.count):
        rng = seed.stream("wish", redraw, candidate, camera)
        style = STYLES[styles[camera]]
        turn = (camera + rng.uniform(-0.15, 0.15)) / config.count
        framing = FRAMINGS[framings[camera]]
        lens = rng.uniform(*framing.lens)
        wishes.append(
            ViewWish(
                camera=camera,
                fov_rad=float(np.radians(config.min_fov_deg + lens * (config.max_fov_deg - config.min_fov_deg))),
                framing=framing,
                grouping=framings[camera],
                style=style,
                height_m=_height_band_m(heights[camera], room_height_m),
                speed_mps=float(rng.uniform(style.least_mps, style.most_mps)),
                azimuth_rad=float(start_azimuth_rad + 2.0 * np.pi * turn),
                sway=_draw_sway(rng, config, style.sway),
            )
        )
    return tuple(wishes)


def _deal(rng: np.random.Generator, options: tuple[Option, ...], count: int) -> list[Option]:
    """``count`` options, each used equally often (up to one) before any repeats, in random order."""
    dealt: list[Option] = []
    while len(dealt) < count:
        dealt += [options[i] for i in rng.permutation(len(options))]
    return dealt[:count]


def _height_band_m(height: Height, room_height_m: float) -> tuple[float, float]:
    bands = {
        "floor": (0.30, 0.70),
        "table": (0.85, 1.25),
        "eye": (1.35, 1.80),
        "ceiling": (room_height_m - 0.75, room_height_m - 0.30),
    }
    return bands[height]


def _draw_sway(rng: np.random.Generator, config: CamerasConfig, fraction: float) -> Sway:
    shape = (6, SWAY_HARMONICS)
    frequency_hz = rng.uniform(*SWAY_HZ, shape)
    # Slow sway is wide, quick sway is small, as of a hand.
    falloff = SWAY_HZ[0] / frequency_hz
    limit = np.array([config.sway_m] * 3 + [np.radians(config.sway_deg)] * 3)[:, None]
    amplitude = fraction * limit * falloff / falloff.sum(axis=1, keepdims=True)
    return Sway(amplitude, frequency_hz, rng.uniform(0.0, 2.0 * np.pi, shape))


def shown_points(wish: ViewWish) -> Float64[np.ndarray, " L"]:
    """Weight of each body point in the framing of this view: those it wishes to show, the head and chest most."""
    weight = np.array([2.0, 2.0, *([1.0] * (len(BODY_LEVELS) - 2))])
    weight[wish.framing.points :] = 0.0
    return weight / weight.sum()
