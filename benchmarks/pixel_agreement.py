"""Counts of pixels whose rendered depth and object index are what rays at the meshes meet at the pixel's centre."""

from dataclasses import dataclass, fields

import numpy as np

from perpetua.audit.deep import SceneRays, off_silhouettes, predict_image
from perpetua.audit.files import SequenceFiles

DEPTH_M, DEPTH_FRACTION = 1e-3, 1e-4


@dataclass(frozen=True)
class PixelCount:
    """Pixels, those off silhouettes, and of the latter those whose depth differs by more than 1 mm + 0.01%; pixels
    whose object differs, of all and of those off silhouettes."""

    pixels: int = 0
    smooth: int = 0
    wrong_depth: int = 0
    wrong_object: int = 0
    wrong_smooth_object: int = 0

    def __add__(self, other: "PixelCount") -> "PixelCount":
        return PixelCount(*(getattr(self, field.name) + getattr(other, field.name) for field in fields(self)))

    def cells(self) -> list[str]:
        """Agreement of depth off silhouettes, of objects off silhouettes and everywhere, in percent."""
        wrong = ((self.wrong_depth, self.smooth), (self.wrong_smooth_object, self.smooth))
        fractions = [
            f"{100 * (1 - count / max(of, 1)):.4f}%" for count, of in (*wrong, (self.wrong_object, self.pixels))
        ]
        return [str(self.pixels), f"{100 * self.smooth / max(self.pixels, 1):.1f}%", *fractions]


HEADINGS = ["pixels", "off silhouettes", "depth", "object", "object, all pixels"]


def count_pixels(
    files: SequenceFiles, rays: SceneRays, object_index: tuple[np.ndarray, ...], view: int, frame: int
) -> PixelCount:
    """Compares one image with rays."""
    expected_m, owner = predict_image(files, rays, str(view), frame)
    smooth = off_silhouettes(expected_m, owner)
    rendered_m = np.asarray(files.of_view(view, "depth.npy")[frame], np.float64)
    far = np.abs(rendered_m - expected_m) > DEPTH_M + DEPTH_FRACTION * expected_m
    other = np.asarray(object_index[view][frame]) != owner
    counts = (smooth, far & smooth, other, other & smooth)
    return PixelCount(owner.size, *(int(np.count_nonzero(which)) for which in counts))
