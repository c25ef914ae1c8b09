"""Whether a baked room looks like the room with its original shaders: SSIM of converged crops, and pairs to look at."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float64, UInt8
from PIL import Image as Pillow
from render_scenes import Image, Loop, Scene, run_loop
from scipy.ndimage import gaussian_filter

from perpetua.io.files import read_json, write_json
from perpetua.rendering.config import RenderConfig

# Luma of sRGB pictures (Rec. 601), and the constants of Wang, Bovik, Sheikh and Simoncelli 2004.
LUMA = np.array([0.299, 0.587, 0.114])
SSIM_SIGMA_PX, SSIM_RADIUS_PX = 1.5, 5
C1, C2 = (0.01 * 255.0) ** 2, (0.03 * 255.0) ** 2
# The views are looked at this small to choose the crops, at this many places along each side.
CHOICE_PX, CHOICE_SAMPLES, PLACES = 128, 8, 7


def ssim(first: UInt8[np.ndarray, "H W 3"], second: UInt8[np.ndarray, "H W 3"]) -> float:
    """Mean structural similarity of the luma, where the 11 x 11 Gaussian window lies inside the image."""
    x, y = first @ LUMA, second @ LUMA
    mean_x, mean_y = _window(x), _window(y)
    variance_x, variance_y = _window(x * x) - mean_x**2, _window(y * y) - mean_y**2
    covariance = _window(x * y) - mean_x * mean_y
    brightness = (2.0 * mean_x * mean_y + C1) / (mean_x**2 + mean_y**2 + C1)
    structure = (2.0 * covariance + C2) / (variance_x + variance_y + C2)
    inside = slice(SSIM_RADIUS_PX, -SSIM_RADIUS_PX)
    return float((brightness * structure)[inside, inside].mean())


def _window(values: Float64[np.ndarray, "H W"]) -> Float64[np.ndarray, "H W"]:
    smooth: Float64[np.ndarray, "H W"] = gaussian_filter(values, SSIM_SIGMA_PX, radius=SSIM_RADIUS_PX)
    return smooth


@dataclass(frozen=True)
class Crop:
    """Where a crop of a view lies, and what came of it."""

    room: str
    camera: int
    border_px: tuple[int, int, int, int]
    ssim: float
    mean_difference: float


def compare_crops(
    scene: Scene, baked: Path, config: RenderConfig, crop_px: int, samples: int, exposure_ev: float | None = None
) -> list[Crop]:
    """One crop of each view of the empty room, with its original shaders and baked, at so many samples, denoised.

    The crop is the one, of a grid over the view, whose picture varies most: it has texture, and edges.
    """
    empty = replace(scene.at(config.width_px), actors=())
    frame = len(empty.cameras[0].world_from_camera) // 2
    every = config.model_copy(update={"noise_threshold": 0.0})
    borders, exposure_ev = choose_borders(scene, baked, config, frame, crop_px, exposure_ev)
    images = [
        Image(f"camera_{camera}", frame, camera, samples, border, seed=camera) for camera, border in enumerate(borders)
    ]
    assert scene.room.blend_path is not None
    blends = {"look_baked": baked, "look_original": scene.room.blend_path}
    ours, original = (
        run_loop(empty, Loop(name, blend, True, "ours", True, exposure_ev), images, every)
        for name, blend in blends.items()
    )
    crops = []
    for image in images:
        first, second = original.picture(image.stem), ours.picture(image.stem)
        difference = float(np.abs(first.astype(float) - second).mean())
        assert image.border_px is not None
        crops.append(Crop(scene.name, image.camera, image.border_px, ssim(first, second), difference))
        beside = np.concatenate([first, second], axis=1)
        Pillow.fromarray(beside).save(scene.folder / f"crop_{image.camera}.png")
    return crops


def choose_borders(
    scene: Scene, baked: Path, config: RenderConfig, frame: int, crop_px: int, exposure_ev: float | None
) -> tuple[list[tuple[int, int, int, int]], float]:
    """A crop of each view, and the exposure metered on the first; chosen once."""
    path = scene.folder / f"crops_{config.width_px}_{crop_px}.json"
    if stored := read_json(path):
        return [tuple(border) for border in stored["borders"]], stored["exposure_ev"]
    small = replace(scene.at(CHOICE_PX), actors=())
    images = [Image(f"camera_{camera.camera}", frame, camera.camera, CHOICE_SAMPLES) for camera in scene.cameras]
    rendered = run_loop(small, Loop("look_choice", baked, True, "ours", True, exposure_ev), images, config)
    borders = []
    for image in images:
        luma = rendered.picture(image.stem) @ LUMA
        side = max(4, round(crop_px * CHOICE_PX / config.width_px))
        rows, columns = (np.linspace(0, length - side, PLACES).astype(int) for length in luma.shape)
        places = [(row, column) for row in rows for column in columns]
        row, column = max(places, key=lambda at: float(luma[at[0] : at[0] + side, at[1] : at[1] + side].std()))
        left, top = (round(at * config.width_px / CHOICE_PX) for at in (column, row))
        left, top = min(left, config.width_px - crop_px), min(top, config.height_px - crop_px)
        borders.append((left, top, left + crop_px, top + crop_px))
    exposure_ev = float(rendered.one("exposure")["exposure_ev"])
    write_json(path, {"borders": borders, "exposure_ev": exposure_ev})
    return borders, exposure_ev


def render_pair(scene: Scene, baked: Path, config: RenderConfig, samples: int, exposure_ev: float | None) -> Path:
    """A whole view with its original shaders (left) and baked (right), at few samples, denoised."""
    empty = replace(scene.at(config.width_px), actors=())
    images = [Image("whole", len(empty.cameras[0].world_from_camera) // 2, 0, samples)]
    assert scene.room.blend_path is not None
    ours = run_loop(empty, Loop("pair_baked", baked, True, "ours", True, exposure_ev), images, config)
    exposure_ev = float(ours.one("exposure")["exposure_ev"])
    original = run_loop(
        empty, Loop("pair_original", scene.room.blend_path, True, "ours", True, exposure_ev), images, config
    )
    path = scene.folder / "pair.png"
    Pillow.fromarray(np.concatenate([original.picture("whole"), ours.picture("whole")], axis=1)).save(path)
    return path
