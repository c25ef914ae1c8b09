"""Resizing by the benchmark's rule: the centres of the corner pixels stay corner centres.

Along an axis of N pixels that becomes N' pixels, pixel centre 0 maps to 0 and N - 1 to N' - 1, so coordinates, focal
lengths and principal points alike scale by (N' - 1) / (N - 1). This is not what image libraries do, which keep the
outer borders of the corner pixels instead.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt8

from perpetua.errors import InputError


@dataclass(frozen=True)
class PixelCentreResize:
    """From images of one size (width, height) to another; each side has at least two pixels."""

    old_px: tuple[int, int]
    new_px: tuple[int, int]

    def __post_init__(self) -> None:
        if min(*self.old_px, *self.new_px) < 2:
            raise InputError(
                f"images must have at least 2 pixels along each side to be resized, not {self.old_px} to {self.new_px}"
            )

    @property
    def scale(self) -> Float64[np.ndarray, "2"]:
        """Factors of x and y."""
        return (np.array(self.new_px) - 1.0) / (np.array(self.old_px) - 1.0)

    def image(self, image: UInt8[np.ndarray, "H W 3"]) -> UInt8[np.ndarray, "new_H new_W 3"]:
        """Linear interpolation when enlarging; when reducing, a mean weighted by a tent, which prevents aliasing."""
        rows = _blend(image.astype(np.float32), _tent(self.old_px[1], self.new_px[1]))
        columns = _blend(np.swapaxes(rows, 0, 1), _tent(self.old_px[0], self.new_px[0]))
        return np.ascontiguousarray(np.swapaxes(np.rint(columns), 0, 1)).astype(np.uint8)

    def nearest(self, picture: np.ndarray) -> np.ndarray:
        """The value at the nearest pixel of pictures (..., H, W) that must not be mixed, such as depth and masks."""
        rows = _nearest(self.old_px[1], self.new_px[1])
        columns = _nearest(self.old_px[0], self.new_px[0])
        return np.asarray(picture[..., rows[:, None], columns])


@dataclass(frozen=True)
class _Taps:
    """For every new pixel the old pixels it is computed from, and their weights."""

    index: Int64[np.ndarray, "new taps"]
    weight: Float32[np.ndarray, "new taps"]


def _tent(old: int, new: int) -> _Taps:
    centre = _old_coordinates(old, new)
    reach = max(1.0, (old - 1) / (new - 1))
    first = np.floor(centre - reach).astype(np.int64) + 1
    index = first[:, None] + np.arange(int(np.ceil(2.0 * reach)))
    away = index - centre[:, None]
    weight = np.clip(1.0 - np.abs(away) / reach, 0.0, None)
    # A tent sampled at whole pixels leans to one side by hundredths of a pixel: tilt it back, so that ramps stay exact.
    lean, spread = (weight * away).sum(axis=1), (weight * away**2).sum(axis=1)
    weight *= 1.0 - np.divide(lean, spread, out=np.zeros_like(lean), where=spread > 0.0)[:, None] * away
    weight /= weight.sum(axis=1, keepdims=True)
    # Mirrored at the centres of the corner pixels: a border pixel is then not pulled inwards.
    mirrored = (old - 1) - np.abs((old - 1) - np.abs(index))
    return _Taps(mirrored.clip(0, old - 1), weight.astype(np.float32))


def _old_coordinates(old: int, new: int) -> Float64[np.ndarray, " new"]:
    return np.arange(new) * ((old - 1) / (new - 1))


def _nearest(old: int, new: int) -> Int64[np.ndarray, " new"]:
    return np.rint(_old_coordinates(old, new)).astype(np.int64)


def _blend(picture: Float32[np.ndarray, "old N 3"], taps: _Taps) -> Float32[np.ndarray, "new N 3"]:
    blended = np.zeros((len(taps.index), *picture.shape[1:]), np.float32)
    for index, weight in zip(taps.index.T, taps.weight.T, strict=True):
        blended += weight[:, None, None] * picture[index]
    return blended
