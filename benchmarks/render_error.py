"""Error at equal time: how far images that took so many CPU seconds are from one of 1,024 samples per pixel."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from render_look import choose_borders
from render_scenes import Image, Loop, Scene, run_loop

from perpetua.rendering.config import RenderConfig

REFERENCE_SAMPLES = 1024
# For images of 512 x 512; smaller ones get as much less as they have fewer pixels.
BUDGETS_S, BUDGET_PX = (10.0, 20.0, 40.0), 512 * 512
PROBES = (2, 8)
# The plain loop renders this much around the crop, so that its denoiser sees a neighbourhood too.
SURROUNDINGS_PX = 56


@dataclass(frozen=True)
class Error:
    """Of one way at one budget: samples per pixel, the CPU seconds of a whole image, and root mean square errors of
    displayed values (0 to 1).
    """

    room: str
    way: str
    budget_s: float
    samples: int
    cpu_s: float
    rmse: float


Border = tuple[int, int, int, int]


def measure_errors(scene: Scene, baked: Path, config: RenderConfig, crop_px: int) -> list[Error]:
    """Errors on one crop of the first view of the empty room; its original shaders are the truth for all ways.

    Ours renders whole images, baked and denoised, whose cost is measured. The plain loop renders with the original
    shaders, without persistent data, with Blender's own settings; of each image only the crop and its surroundings,
    and the cost of a whole one is the scene's synchronisation plus as much more sampling as it has more pixels. Its
    room is the one that is prepared for rendering, as the room as made would differ from the truth by its glass; that
    spares it the modifiers. Where a budget does not pay for one sample it gets one nevertheless.
    """
    empty = replace(scene.at(config.width_px), actors=())
    frame = len(empty.cameras[0].world_from_camera) // 2
    (border, *_), exposure_ev = choose_borders(scene, baked, config, frame, crop_px, None)
    original = scene.room.blend_path
    assert original is not None
    truth = run_loop(
        empty,
        Loop("error_truth", original, True, "every", False, exposure_ev),
        [Image("truth", frame, 0, REFERENCE_SAMPLES, border, seed=99)],
        config,
    ).picture("truth")
    return [
        *_errors_of_ours(empty, Loop("error_ours", baked, True, "ours", True, exposure_ev), config, border, truth),
        *_errors_of_plain(
            empty, Loop("error_plain", original, False, "blender", True, exposure_ev), config, border, truth
        ),
    ]


def _errors_of_ours(scene: Scene, loop: Loop, config: RenderConfig, border: Border, truth: np.ndarray) -> list[Error]:
    frame = len(scene.cameras[0].world_from_camera) // 2
    warm = Image("warm", frame - 1, 0, 1)
    probes = run_loop(
        scene, replace(loop, name="error_probe"), [warm, *(Image(f"{n}", frame, 0, n) for n in PROBES)], config
    )
    fixed_s, sample_s = _line([float(probes.images()[f"{n}"]["cpu_s"]) for n in PROBES])
    budgets_s = [budget_s * config.width_px * config.height_px / BUDGET_PX for budget_s in BUDGETS_S]
    counts = [max(1, int((budget_s - fixed_s) / sample_s)) for budget_s in budgets_s]
    images = [Image(f"budget_{n}", frame, 0, n) for n in counts]
    rendered = run_loop(scene, loop, [warm, *images], config)
    left, top, right, bottom = border
    errors = []
    for budget_s, image in zip(BUDGETS_S, images, strict=True):
        crop = rendered.picture(image.stem)[top:bottom, left:right]
        cpu_s = float(rendered.images()[image.stem]["cpu_s"])
        errors.append(Error(scene.name, "ours", budget_s, image.samples, cpu_s, _rmse(crop, truth)))
    return errors


def _errors_of_plain(scene: Scene, loop: Loop, config: RenderConfig, border: Border, truth: np.ndarray) -> list[Error]:
    frame = len(scene.cameras[0].world_from_camera) // 2
    around, inside = _surroundings(border, config.width_px, config.height_px)
    probes = run_loop(
        scene, replace(loop, name="error_plain_probe"), [Image(f"{n}", frame, 0, n, around) for n in PROBES], config
    )
    fixed_s, part_s = _line([float(probes.images()[f"{n}"]["cpu_s"]) for n in PROBES])
    fraction = (around[2] - around[0]) * (around[3] - around[1]) / (config.width_px * config.height_px)
    sample_s = part_s / fraction
    budgets_s = [budget_s * config.width_px * config.height_px / BUDGET_PX for budget_s in BUDGETS_S]
    counts = [max(1, int((budget_s - fixed_s) / sample_s)) for budget_s in budgets_s]
    errors = []
    for denoise, way in ((False, "plain"), (True, "plain, denoised")):
        images = [Image(f"{n}", frame, 0, n, around) for n in sorted(set(counts))]
        rendered = run_loop(scene, replace(loop, name=f"error_{way}", denoise=denoise), images, config)
        for budget_s, n in zip(BUDGETS_S, counts, strict=True):
            crop = rendered.picture(f"{n}")[inside]
            errors.append(Error(scene.name, way, budget_s, n, fixed_s + n * sample_s, _rmse(crop, truth)))
    return errors


def _surroundings(border: Border, width_px: int, height_px: int) -> tuple[Border, tuple[slice, slice]]:
    """A larger border, and where the smaller one lies in it (rows, columns)."""
    left, top = max(0, border[0] - SURROUNDINGS_PX), max(0, border[1] - SURROUNDINGS_PX)
    right, bottom = min(width_px, border[2] + SURROUNDINGS_PX), min(height_px, border[3] + SURROUNDINGS_PX)
    rows, columns = slice(border[1] - top, border[3] - top), slice(border[0] - left, border[2] - left)
    return (left, top, right, bottom), (rows, columns)


def _line(seconds: list[float]) -> tuple[float, float]:
    """What an image costs at no samples, and each sample, from the costs at ``PROBES``."""
    sample_s = (seconds[1] - seconds[0]) / (PROBES[1] - PROBES[0])
    return seconds[0] - PROBES[0] * sample_s, sample_s


def _rmse(picture: np.ndarray, truth: np.ndarray) -> float:
    return float(np.sqrt(((picture.astype(np.float64) - truth) ** 2).mean()) / 255.0)
