"""Pictures for walls and patterns for rugs, painted with numpy."""

import colorsys
import itertools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float64, UInt8

Image = Float64[np.ndarray, "H W 3"]
Color = Float64[np.ndarray, "3"]
PRINT_PX = (144, 112)
RUG_PX = (120, 180)


def paint_print(rng: np.random.Generator, hue: float) -> UInt8[np.ndarray, "H W 3"]:
    """An upright wall print in sRGB with a pale border: one of six manners, its colours around ``hue``."""
    height, width = PRINT_PX
    inner = PAINTERS[int(rng.integers(len(PAINTERS)))](rng, hue, height - 24, width - 24)
    canvas = np.full((height, width, 3), _color(hue, 0.05, 0.93))
    canvas[12:-12, 12:-12] = inner
    return _to_bytes(canvas)


def paint_rug(rng: np.random.Generator, tones: Float64[np.ndarray, "3 3"]) -> UInt8[np.ndarray, "H W 3"]:
    """A rug in sRGB of three tones (linear RGB): borders around a field of bands, diamonds, or plain wool."""
    height, width = RUG_PX
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    edge = np.minimum(np.minimum(x, width - 1 - x), np.minimum(y, height - 1 - y))
    u, v = np.abs(x - 0.5 * width + 0.5), np.abs(y - 0.5 * height + 0.5)
    # Display gamma, near enough for wool.
    ground, second, third = np.clip(tones, 0.0, 1.0) ** (1.0 / 2.2)
    canvas = np.broadcast_to(ground, (height, width, 3)).copy()
    manner = int(rng.integers(4))
    if manner == 0:
        canvas[((u + v) // 15).astype(int) % 3 == 0] = second
        canvas[((u + v) // 15).astype(int) % 6 == 1] = third
    elif manner == 1:
        canvas[(u // rng.integers(7, 16)).astype(int) % 2 == 0] = second
    elif manner == 2:
        diamond = (np.abs((x % 36) - 17.5) + np.abs((y % 30) - 14.5)) / 16.0
        canvas[diamond < 0.9] = second
        canvas[diamond < 0.45] = third
    bands = ((4, 7, third), (9, 15, second), (17, 18, third)) if rng.uniform() < 0.7 else ((3, 4, second),)
    for low, high, color in bands:
        canvas[(edge >= low) & (edge < high)] = color
    return _to_bytes(canvas * rng.uniform(0.9, 1.0, size=(height, width, 1)))


def _to_bytes(canvas: Image) -> UInt8[np.ndarray, "H W 3"]:
    return np.clip(255.0 * canvas, 0.0, 255.0).astype(np.uint8)


def _color(hue: float, saturation: float, value: float) -> Color:
    return np.array(colorsys.hsv_to_rgb(float(hue) % 1.0, float(saturation), float(value)))


def _grid(height: int, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates up to 1 along the height: x to the right from the middle, y up from the lower edge."""
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    return (x - 0.5 * width + 0.5) / height, (height - 0.5 - y) / height


def _hills(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """Ridges one behind the other under a sun."""
    x, y = _grid(height, width)
    canvas = _color(hue + 0.5, 0.2, 0.95) * (1 - y[..., None]) + _color(hue + 0.45, 0.35, 0.85) * y[..., None]
    sun = np.hypot(x - rng.uniform(-0.25, 0.25), y - rng.uniform(0.65, 0.85)) < rng.uniform(0.07, 0.13)
    canvas[sun] = _color(hue + 0.55, 0.6, 1.0)
    for index in range(5):
        waves = [np.sin(rng.uniform(3, 14) * x + rng.uniform(0, 6.28)) / (step + 1) for step in range(3)]
        ridge = 0.62 - 0.12 * index + 0.06 * sum(waves)
        canvas[y < ridge] = _color(hue + 0.02 * index, 0.25 + 0.1 * index, 0.8 - 0.13 * index)
    return canvas


def _circles(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """Discs and half discs over each other on a pale ground."""
    x, y = _grid(height, width)
    canvas = np.broadcast_to(_color(hue, 0.1, 0.9), (height, width, 3)).copy()
    for _ in range(int(rng.integers(4, 8))):
        centre, radius = rng.uniform((-0.3, 0.15), (0.3, 0.85)), rng.uniform(0.08, 0.3)
        disc = np.hypot(x - centre[0], y - centre[1]) < radius
        if rng.uniform() < 0.5:
            turn = rng.uniform(0, 2 * np.pi)
            disc &= np.cos(turn) * (x - centre[0]) + np.sin(turn) * (y - centre[1]) > 0
        canvas[disc] = _color(hue + rng.choice([0.0, 0.06, 0.5, 0.58]), rng.uniform(0.3, 0.8), rng.uniform(0.3, 0.95))
    return canvas


def _grids(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """Fields between dark lines."""
    canvas = np.full((height, width, 3), 0.93)
    rows = [0, *sorted(rng.choice(np.arange(12, height - 12, 8), 3, replace=False)), height]
    columns = [0, *sorted(rng.choice(np.arange(10, width - 10, 6), 3, replace=False)), width]
    for top, bottom in itertools.pairwise(rows):
        for left, right in itertools.pairwise(columns):
            if rng.uniform() < 0.5:
                shade = _color(hue + rng.choice([0.0, 0.33, 0.6]), rng.uniform(0.4, 0.85), rng.uniform(0.5, 0.9))
                canvas[top:bottom, left:right] = shade
            canvas[max(0, top - 1) : top + 2, left:right] = 0.08
            canvas[top:bottom, max(0, left - 1) : left + 2] = 0.08
    return canvas


def _leaves(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """A stem with paired leaves on paper."""
    x, y = _grid(height, width)
    canvas = np.broadcast_to(_color(0.12, 0.08, 0.93), (height, width, 3)).copy()
    green = _color(rng.choice([0.3, 0.38, hue]), rng.uniform(0.35, 0.6), rng.uniform(0.25, 0.5))
    bend = rng.uniform(-0.25, 0.25)
    stem = bend * (y - 0.1) ** 2
    canvas[(np.abs(x - stem) < 0.006) & (y > 0.08) & (y < 0.88)] = 0.7 * green
    for index in range(10):
        base, side = 0.2 + 0.065 * index, 1.0 if index % 2 == 0 else -1.0
        turn = side * rng.uniform(0.5, 0.9)
        dx, dy = x - bend * (base - 0.1) ** 2, y - base
        along, across = np.sin(turn) * dx + np.cos(turn) * dy, np.cos(turn) * dx - np.sin(turn) * dy
        length = 0.26 - 0.014 * index
        fraction = along / length
        canvas[(fraction > 0) & (fraction < 1) & (np.abs(across) < 0.045 * np.sin(np.pi * np.clip(fraction, 0, 1)))] = (
            green * rng.uniform(0.8, 1.2)
        )
    return np.clip(canvas, 0.0, 1.0)


def _waves(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """Bands of colour that run in and out of each other."""
    x, y = _grid(height, width)
    for _ in range(3):
        x, y = (
            x + 0.12 * np.sin(rng.uniform(3, 9) * y + rng.uniform(0, 6.28)),
            y + 0.12 * np.sin(rng.uniform(3, 9) * x + rng.uniform(0, 6.28)),
        )
    band = (np.floor(9 * y).astype(int)) % 5
    colors = [_color(hue + rng.uniform(-0.12, 0.12), rng.uniform(0.2, 0.7), rng.uniform(0.35, 0.95)) for _ in range(5)]
    return np.array(colors)[band]


def _arches(rng: np.random.Generator, hue: float, height: int, width: int) -> Image:
    """Nested arches."""
    x, y = _grid(height, width)
    canvas = np.broadcast_to(_color(hue + 0.5, 0.12, 0.9), (height, width, 3)).copy()
    foot, spring = 0.12, rng.uniform(0.4, 0.6)
    distance = np.where(y > spring, np.hypot(x, y - spring), np.abs(x))
    for index, radius in enumerate(np.arange(0.34, 0.04, -0.06)):
        color = _color(hue + 0.07 * index, 0.3 + 0.08 * (index % 3), rng.uniform(0.5, 0.95))
        canvas[(distance < radius) & (y > foot)] = color
    return canvas


PAINTERS: tuple[Callable[[np.random.Generator, float, int, int], Image], ...] = (
    _hills,
    _circles,
    _grids,
    _leaves,
    _waves,
    _arches,
)
