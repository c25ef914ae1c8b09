"""Skin and eyes: sRGB images painted by where each texel lies on the base mesh."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Float32, Float64, UInt8
from scipy import ndimage

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.images import tileable_noise, to_srgb

SKIN_PX = 1024
EYE_PX = 128
# Rows from and to, and columns from, which the head takes up in the skin image.
_HEAD_PX = (170, 890, 640)
_EYE_M = np.array([0.125, 0.031, 0.729])
_IRIS_FRACTION = 0.50


@dataclass(frozen=True)
class Complexion:
    """Colours of one person, linear RGB; ``beard`` 0 (shaven) to 1, ``greying`` of brows and beard in ``hair``."""

    skin: tuple[float, float, float]
    hair: tuple[float, float, float]
    iris: tuple[float, float, float]
    beard: float
    brow_m: float
    age: float


@lru_cache(maxsize=1)
def texel_places_m() -> Float32[np.ndarray, "S S 3"]:
    """Where on the base mesh each texel of the skin lies; those outside it are given their nearest neighbour's."""
    mesh = base_mesh()
    body = mesh.groups["body"]
    corner_px = np.stack([mesh.uv[:, 0], 1.0 - mesh.uv[:, 1]], axis=1)[body.uv_faces] * SKIN_PX
    corner_m = mesh.vertices_m[body.faces]
    size_px = np.abs(corner_px - np.roll(corner_px, 1, axis=1)).max(axis=(1, 2))
    places = np.zeros((SKIN_PX, SKIN_PX, 3), dtype=np.float32)
    known = np.zeros((SKIN_PX, SKIN_PX), dtype=bool)
    for steps in (4, 8, 16, 32, 64):
        chosen = (size_px * 1.5 <= steps) & (size_px * 1.5 > (steps // 2 if steps > 4 else -1))
        edge = (np.arange(steps) + 0.5) / steps
        s, t = (axis.ravel()[None, :, None] for axis in np.meshgrid(edge, edge))
        fractions = ((1 - s) * (1 - t), s * (1 - t), s * t, (1 - s) * t)
        pixel = sum(fraction * corner_px[chosen][:, None, corner] for corner, fraction in enumerate(fractions))
        place = sum(fraction * corner_m[chosen][:, None, corner] for corner, fraction in enumerate(fractions))
        column, row = np.moveaxis(np.clip(np.floor(pixel), 0, SKIN_PX - 1).astype(np.int64), -1, 0)
        places[row.ravel(), column.ravel()] = place.reshape(-1, 3)
        known[row.ravel(), column.ravel()] = True
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    return np.asarray(places[tuple(nearest)])


def _blob(places: np.ndarray, centre: tuple[float, float, float], radius: tuple[float, float, float]) -> np.ndarray:
    """A soft spot on both sides of the face."""
    mirrored = np.stack([places[..., 0], np.abs(places[..., 1]), places[..., 2]], axis=-1)
    distance = (mirrored - np.array(centre)) / np.array(radius)
    return np.asarray(np.exp(-np.sum(distance * distance, axis=-1)))


def _brows(places: np.ndarray, width_m: float) -> np.ndarray:
    """Eyebrows: an arch above each eye that thins outward."""
    side = np.abs(places[..., 1])
    fraction = np.clip((side - 0.011) / 0.042, 0.0, 1.0)
    arch = 0.007 * np.sin(np.pi * np.clip(fraction * 0.85, 0.0, 1.0))
    arch_z = _EYE_M[2] + 0.0195 + arch - 0.004 * fraction * fraction
    half = width_m * (1.0 - 0.65 * fraction)
    across = np.clip(1.5 - np.abs(places[..., 2] - arch_z) / half, 0.0, 1.0)
    ends = np.clip((side - 0.009) / 0.004, 0.0, 1.0) * np.clip((0.054 - side) / 0.006, 0.0, 1.0)
    return np.asarray(across * ends * (places[..., 0] > 0.10))


def _beard(places: np.ndarray) -> np.ndarray:
    """Where beards grow: jaw, chin, upper lip."""
    x, side, z = places[..., 0], np.abs(places[..., 1]), places[..., 2]
    edge = 0.672 + 0.35 * np.maximum(side - 0.045, 0.0)
    jaw = np.clip((edge - z) / 0.012, 0.0, 1.0) * np.clip((z - 0.600) / 0.015, 0.0, 1.0)
    front = np.clip((x - 0.045) / 0.02, 0.0, 1.0)
    mouth = 1.0 - np.clip(2.2 * _blob(places, (0.15, 0.0, 0.657), (0.03, 0.030, 0.010)), 0.0, 1.0)
    lip = np.clip(2.0 * _blob(places, (0.155, 0.012, 0.671), (0.03, 0.020, 0.005)), 0.0, 1.0)
    cheeks = 1.0 - np.clip((z - 0.668) / 0.01, 0.0, 1.0) * np.clip((0.055 - side) / 0.02, 0.0, 1.0)
    return np.asarray(np.maximum(jaw * front * mouth * cheeks, lip))


def _noise(rng: np.random.Generator, cells: int, octaves: int) -> Float64[np.ndarray, "S S"]:
    """Noise over the skin image, made at half its size."""
    return np.asarray(np.kron(tileable_noise(rng, SKIN_PX // 2, cells, octaves), np.ones((2, 2))))


def _face_colour(places: np.ndarray, colour: np.ndarray, look: Complexion, strands: np.ndarray) -> np.ndarray:
    """The head's texels with flushed cheeks, nose and ears, darker lids, lips, brows and beard."""
    flush = 0.55 * _blob(places, (0.13, 0.045, 0.69), (0.04, 0.025, 0.02))
    flush += 0.5 * _blob(places, (0.175, 0.0, 0.70), (0.02, 0.014, 0.012))
    flush += 0.4 * _blob(places, (0.045, 0.087, 0.72), (0.03, 0.012, 0.04))
    colour = colour * (1.0 - np.clip(flush, 0.0, 1.0)[..., None] * np.array([0.02, 0.16, 0.16]))
    shade = 0.22 * _blob(places, (0.125, 0.031, 0.722), (0.03, 0.022, 0.012))
    colour = colour * (1.0 - shade[..., None] * np.array([0.6, 1.0, 0.9]))
    lips = np.clip(1.6 * _blob(places, (0.155, 0.0, 0.6575), (0.03, 0.024, 0.0075)) - 0.45, 0.0, 1.0)[..., None]
    colour = colour * (1.0 - 0.8 * lips * (1.0 - np.array([0.80, 0.48, 0.50])))
    cover = np.clip(_brows(places, look.brow_m) * strands, 0.0, 0.95)
    cover = np.maximum(cover, np.clip(look.beard * _beard(places) * strands, 0.0, 0.9))[..., None]
    return np.asarray(colour * (1.0 - cover) + np.array(look.hair) * cover)


def paint_skin(
    look: Complexion, scalp: Float32[np.ndarray, "S S"], rng: np.random.Generator
) -> UInt8[np.ndarray, "S S 3"]:
    """The skin image of one person for the base mesh's UVs; ``scalp`` is how much hair shades each texel, 0 to 1."""
    mottle = 1.0 + 0.035 * _noise(rng, 12, 4) + 0.02 * _noise(rng, 120, 2)
    freckles = np.clip(_noise(rng, 90, 2) - 2.5, 0.0, 1.0)
    strands = 0.8 + 0.25 * tileable_noise(rng, SKIN_PX, 150, 2)
    colour = np.array(look.skin) * (mottle * (1.0 - 0.35 * freckles))[..., None]
    # The head is one block of the image.
    head = np.s_[_HEAD_PX[0] : _HEAD_PX[1], _HEAD_PX[2] :]
    places = texel_places_m()[head].astype(np.float64)
    colour[head] = _face_colour(places, colour[head], look, strands[head])
    cover = (0.92 * np.clip(scalp * (0.75 + 0.3 * strands), 0.0, 1.0))[..., None]
    return to_srgb(colour * (1.0 - cover) + np.array(look.hair) * cover)


def paint_eye(look: Complexion, rng: np.random.Generator) -> UInt8[np.ndarray, "E E 3"]:
    """An eye seen from the front: white, iris and pupil."""
    axis = (np.arange(EYE_PX) + 0.5) / EYE_PX * 2.0 - 1.0
    x, y = np.meshgrid(axis, axis)
    radius, angle = np.hypot(x, y), np.arctan2(y, x)
    white = np.array([0.72, 0.68, 0.64]) * (1.0 - 0.3 * np.clip(radius - 0.6, 0.0, 1.0)[..., None])
    fibres = np.zeros_like(angle)
    for count in (11, 23, 37):
        fibres += np.sin(count * angle + rng.uniform(0.0, 2.0 * np.pi)) / 3.0
    iris = np.array(look.iris) * (1.0 + 0.35 * fibres)[..., None]
    ring = np.clip((radius - 0.8 * _IRIS_FRACTION) / (0.2 * _IRIS_FRACTION), 0.0, 1.0)[..., None]
    iris = iris * (1.0 - 0.75 * ring)
    colour = np.where((radius < _IRIS_FRACTION)[..., None], iris, white)
    return to_srgb(np.where((radius < 0.42 * _IRIS_FRACTION)[..., None], 0.004, colour))


def eye_uv(eye_m: Float64[np.ndarray, "E 3"], corners_m: Float64[np.ndarray, "F 3 3"]) -> Float32[np.ndarray, "F 3 2"]:
    """UVs that look straight at an eye from the front; ``corners_m`` are those of its faces."""
    centre = 0.5 * (eye_m.min(axis=0) + eye_m.max(axis=0))
    radius = 0.5 * float(np.ptp(eye_m[:, 2]))
    offset = (corners_m - centre) / (2.0 * radius)
    return np.stack([0.5 + offset[..., 1], 0.5 + offset[..., 2]], axis=2).astype(np.float32)
