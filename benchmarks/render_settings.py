"""What each sampling setting costs and how much it errs: CPU seconds per image against a picture of many samples.

    perpetua generate --preset quick --seed 3 --until cameras --out plans
    python benchmarks/render_settings.py plans/.work/seed3-room0000 --width 96 --reference 1024

Each row changes one setting of the config's defaults. A row's CPU seconds are those of its own render, less those that
starting Blender takes, which a render of 1 sample tells. The error is the root mean square difference of the pictures,
of 255 levels, over all views of one frame; the reference is rendered without denoiser, clamping and noise threshold.
"""

import argparse
import os
import resource
import shutil
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64
from PIL import Image
from render_worker import Scene, load_scene

from perpetua.rendering.config import RenderConfig
from perpetua.rendering.job import EXPOSURE_FILE, write_job
from perpetua.rendering.render import render_views

EXACT: dict[str, Any] = {"denoise": False, "clamp_indirect": 0.0, "noise_threshold": 0.0}
ROWS: tuple[tuple[str, dict[str, Any]], ...] = (
    ("defaults", {}),
    ("no denoiser", {"denoise": False}),
    ("guides not denoised", {"denoise_guides": "none"}),
    ("guides denoised fast", {"denoise_guides": "fast"}),
    ("light tree", {"light_tree": True}),
    ("2 bounces", {"max_bounces": 2}),
    ("3 bounces", {"max_bounces": 3}),
    ("6 bounces", {"max_bounces": 6}),
    ("12 bounces", {"max_bounces": 12}),
    ("no clamping", {"clamp_indirect": 0.0}),
    ("clamped at 1", {"clamp_indirect": 1.0}),
    ("clamped at 10", {"clamp_indirect": 10.0}),
    ("all samples", {"noise_threshold": 0.0}),
    ("threshold 0.02", {"noise_threshold": 0.02}),
    ("threshold 0.1", {"noise_threshold": 0.1}),
)


def main() -> None:
    """Prints the table, a row as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", type=Path, help="work area of one room, finished up to its cameras")
    parser.add_argument("--width", type=int, default=96)
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--reference", type=int, default=1024, help="samples of the reference")
    parser.add_argument("--views", type=int, default=4)
    parser.add_argument("--rows", nargs="*", default=[], help="some of the rows; none: all")
    parser.add_argument("--blend", type=Path, default=None, help="a room that is baked already")
    parser.add_argument("--scratch", type=Path, default=Path("render_settings"))
    given = parser.parse_args()
    given.scratch.mkdir(parents=True, exist_ok=True)
    size = {"width_px": given.width, "height_px": given.width, "bake": False, "jpeg_quality": 100}
    config = RenderConfig(**size, samples=given.samples)
    scene = load_scene(given.work, config, given.blend, given.scratch).cut(1, given.views)
    exact = config.model_copy(update={**EXACT, "samples": given.reference, "max_bounces": 12})
    blank = config.model_copy(update={**EXACT, "samples": 1})
    render(scene, blank, given.scratch)
    # Metered by then, as it is for all rows.
    _, start_s = render(scene, blank, given.scratch)
    reference, reference_s = render(scene, exact, given.scratch)
    print(f"{given.width} px, {given.views} views, load {os.getloadavg()[0]:.1f}; CPU s per image")
    print(f"{'reference':<24}{(reference_s - start_s) / given.views:8.2f}", flush=True)
    for name, change in ((name, change) for name, change in ROWS if not given.rows or name in given.rows):
        pictures, cpu_s = render(scene, config.model_copy(update=change), given.scratch)
        error = float(np.sqrt(((pictures - reference) ** 2).mean()))
        print(f"{name:<24}{(cpu_s - start_s) / given.views:8.2f}{error:8.2f} levels", flush=True)


def render(scene: Scene, config: RenderConfig, scratch: Path) -> tuple[Float64[np.ndarray, "V H W 3"], float]:
    """Pictures of one frame and the CPU seconds of the process that made them; exposure is the same for all rows."""
    folder, kept = scratch / "row", scratch / EXPOSURE_FILE
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    write_job(folder, scene.room, scene.actors, scene.cameras, config, "cpu", {})
    if kept.is_file():
        shutil.copy(kept, folder / EXPOSURE_FILE)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    views = render_views(scene.room, scene.actors, scene.cameras, config, "cpu", folder, lambda *_: None)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    shutil.copy(folder / EXPOSURE_FILE, kept)
    pictures = np.stack([np.asarray(Image.open(BytesIO(view.jpeg[0])), np.float64) for view in views])
    return pictures, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
