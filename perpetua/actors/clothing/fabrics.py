"""Fabrics: small tileable sRGB images with the grain of real cloth."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, UInt8

from perpetua.actors.base.images import tileable_noise, to_srgb

SIZE_PX = 384
FABRICS = ("plain", "heather", "stripes", "checks", "gingham", "denim", "knit", "dots", "print")


@dataclass(frozen=True)
class Fabric:
    """A tile of cloth: ``image`` repeats every ``tile_m`` metres."""

    name: str
    image: UInt8[np.ndarray, "H W 3"]
    tile_m: float
    roughness: float


def _grid() -> tuple[Float64[np.ndarray, "S S"], Float64[np.ndarray, "S S"]]:
    axis = (np.arange(SIZE_PX) + 0.5) / SIZE_PX
    column, row = np.meshgrid(axis, axis)
    return column, row


def _weave(rng: np.random.Generator) -> Float64[np.ndarray, "S S"]:
    """Brightness of woven threads, with a few thicker ones, around 1."""
    column, row = _grid()
    threads = 96
    warp = np.sin(2.0 * np.pi * threads * column) * 0.5
    weft = np.sin(2.0 * np.pi * threads * row) * 0.5
    slub = rng.normal(0.0, 0.035, SIZE_PX)[None, :] + rng.normal(0.0, 0.035, SIZE_PX)[:, None]
    return np.asarray(1.0 + 0.06 * warp * weft + slub + 0.03 * tileable_noise(rng, SIZE_PX, 40, 3))


def _mix(base: np.ndarray, other: np.ndarray, fraction: np.ndarray) -> Float64[np.ndarray, "S S 3"]:
    return np.asarray(base * (1.0 - fraction[..., None]) + other * fraction[..., None])


def _band(coordinate: np.ndarray, count: int, width: float) -> np.ndarray:
    """1 within bands that cover ``width`` of each of ``count`` periods, with soft edges."""
    phase = np.abs((coordinate * count) % 1.0 - 0.5)
    return np.asarray(np.clip((0.5 * width - phase) * SIZE_PX / count / 2.0 + 0.5, 0.0, 1.0))


def _stripes(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    _, row = _grid()
    count = int(rng.integers(4, 9))
    colour = _mix(base, other, _band(row, count, float(rng.uniform(0.25, 0.55))))
    return np.asarray(colour * _weave(rng)[..., None])


def _checks(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    column, row = _grid()
    thick, thin = int(rng.integers(3, 6)), float(rng.uniform(0.06, 0.12))
    fraction = 0.55 * (_band(column, thick, 0.42) + _band(row, thick, 0.42)) * 0.8
    light = np.maximum(_band(column + 0.5 / thick, thick, thin), _band(row + 0.5 / thick, thick, thin))
    colour = _mix(_mix(base, other, np.clip(fraction, 0.0, 0.95)), np.full(3, 0.75), 0.7 * light)
    return np.asarray(colour * _weave(rng)[..., None])


def _gingham(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    column, row = _grid()
    count = int(rng.integers(8, 14))
    fraction = 0.5 * (_band(column, count, 0.5) + _band(row, count, 0.5))
    return np.asarray(_mix(np.maximum(base, 0.55), other, fraction) * _weave(rng)[..., None])


def _denim(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    column, row = _grid()
    twill = 0.5 + 0.5 * np.sin(2.0 * np.pi * 64 * (column + row))
    yarn = rng.normal(0.0, 0.045, SIZE_PX)[None, :] + 0.05 * tileable_noise(rng, SIZE_PX, 60, 2)
    fade = 0.018 * tileable_noise(rng, SIZE_PX, 3, 3)
    fraction = np.clip(0.08 + 0.20 * twill + yarn + fade, 0.0, 1.0)
    return _mix(base, np.array([0.30, 0.40, 0.56]), fraction)


def _knit(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    column, row = _grid()
    wales = 32
    lean = np.abs((column * wales) % 1.0 - 0.5)
    loops = np.sin(2.0 * np.pi * (row * wales * 1.0 + 1.1 * lean))
    relief = 0.78 + 0.16 * loops - 0.30 * (lean < 0.06) + 0.06 * tileable_noise(rng, SIZE_PX, 30, 3)
    motif = _band(row, 2, float(rng.uniform(0.08, 0.3))) if rng.random() < 0.5 else np.zeros_like(row)
    return np.asarray(_mix(base, other, motif) * relief[..., None] * 1.15)


def _dots(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    column, row = _grid()
    # An odd count would shift the rows against the next tile's.
    count = 2 * int(rng.integers(3, 6))
    shifted = column * count + 0.5 * (np.floor(row * count) % 2)
    distance = np.hypot(shifted % 1.0 - 0.5, (row * count) % 1.0 - 0.5)
    fraction = np.clip((0.2 - distance) * SIZE_PX / count / 2.0 + 0.5, 0.0, 1.0)
    return np.asarray(_mix(base, other, fraction) * _weave(rng)[..., None])


def _print(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    blots = tileable_noise(rng, SIZE_PX, 5, 3)
    specks = tileable_noise(rng, SIZE_PX, 12, 2)
    fraction = np.clip(6.0 * (blots - 0.5), 0.0, 1.0)
    third = np.clip(np.stack([other[1], other[2], other[0]]) * 0.8 + 0.1, 0.0, 1.0)
    colour = _mix(_mix(base, other, fraction), third, np.clip(6.0 * (specks - 1.3), 0.0, 1.0))
    return np.asarray(colour * _weave(rng)[..., None])


def _plain(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    worn = 1.0 + 0.05 * tileable_noise(rng, SIZE_PX, 4, 4)
    return np.asarray(base * (_weave(rng) * worn)[..., None])


def _heather(base: np.ndarray, other: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    flecks = 0.5 * tileable_noise(rng, SIZE_PX, 60, 2) + 0.4 * rng.standard_normal((SIZE_PX, SIZE_PX))
    return np.asarray(np.maximum(base, 0.03) * np.clip(1.0 + 0.22 * flecks, 0.2, 2.0)[..., None])


_WEAVERS = {
    "plain": (_plain, 0.30, 0.75),
    "heather": (_heather, 0.30, 0.85),
    "stripes": (_stripes, 0.24, 0.75),
    "checks": (_checks, 0.24, 0.8),
    "gingham": (_gingham, 0.20, 0.75),
    "denim": (_denim, 0.22, 0.8),
    "knit": (_knit, 0.20, 0.9),
    "dots": (_dots, 0.26, 0.7),
    "print": (_print, 0.36, 0.7),
}


def weave(
    name: str, base: tuple[float, float, float], other: tuple[float, float, float], rng: np.random.Generator
) -> Fabric:
    """A fabric of ``FABRICS`` in two linear colours."""
    weaver, tile_m, roughness = _WEAVERS[name]
    linear = weaver(np.array(base), np.array(other), rng)
    return Fabric(name, to_srgb(linear), tile_m, roughness)
