"""What rendering costs and how it looks, against the plain way: ``python benchmarks/render.py PART OUT... --to DIR``.

Each OUT is a folder of ``perpetua generate --until cameras``; its first room is used. PART is

- ``costs``: CPU seconds of an image, plain loop on the room as made against ours, and what each saving brings;
- ``look``: SSIM of converged crops, original shaders against baked, and whole pairs to look at;
- ``errors``: error at equal time against 1,024 samples, on the first OUT's rooms;
- ``memory``: the peak of the render worker at full size.

Everything is kept in DIR and not measured again; DIR/PART.md holds the table.
"""

import argparse
import os
import statistics
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from render_costs import STEPS, Costs, measure_costs
from render_error import BUDGET_PX, REFERENCE_SAMPLES, Error, measure_errors
from render_look import Crop, compare_crops, render_pair
from render_scenes import FRAMES, VIEWS, Scene, bake_scene, load_scene, spent_by_children

from perpetua.io.files import read_json, write_json
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.render import render_views

COST_COLUMNS = ("times less", "wall s, plain", "wall s, ours", "baking, once", "MB, plain", "MB, ours")


def main() -> None:
    """Measures one part in all rooms and writes its table."""
    options = _options()
    parts: dict[str, Callable[[argparse.Namespace, list[Scene]], list[str]]] = {
        "costs": _costs,
        "look": _look,
        "errors": _errors,
        "memory": _memory,
    }
    lines: list[str] = []
    scenes: list[Scene] = []
    for out in options.outs:
        scenes.append(load_scene(out, options.to / out.name))
        lines = parts[options.part](options, scenes)
        (options.to / f"{options.part}.md").write_text("\n".join(lines) + "\n", encoding="utf-8")
    print("\n".join(lines))


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("part", choices=("costs", "look", "errors", "memory"))
    parser.add_argument("outs", type=Path, nargs="+", metavar="OUT")
    parser.add_argument("--to", type=Path, required=True, metavar="DIR", help="folder of the results")
    parser.add_argument("--width", type=int, default=None, help="image width; costs: 192, else 512")
    parser.add_argument("--samples", type=int, default=None, help="costs: 16, look: 512, memory: 32")
    parser.add_argument("--bake-width", type=int, default=512, help="width of the images that rooms are baked for")
    parser.add_argument("--max-texels", type=int, default=RenderConfig().max_texels, help="render.max_texels")
    parser.add_argument("--pair-samples", type=int, default=24, help="samples of the pairs to look at")
    parser.add_argument("--crop", type=int, default=64, help="side of the crops, pixels")
    return parser.parse_args()


def _config(options: argparse.Namespace, width_px: int, samples: int) -> RenderConfig:
    width_px, samples = options.width or width_px, options.samples or samples
    return RenderConfig(width_px=width_px, height_px=width_px, samples=samples)


def _costs(options: argparse.Namespace, scenes: list[Scene]) -> list[str]:
    config = _config(options, 192, 16)
    results = [measure_costs(scene, config, *_bake(options, scene)) for scene in scenes]
    lines = [
        f"# CPU seconds per image of {config.width_px} x {config.height_px} px at {config.samples} samples, denoised",
        "",
        f"Over a sequence of {FRAMES} frames x {VIEWS} views, with what is paid once. Load when done: {_load()}.",
        "",
        _row(
            [
                "room",
                "objects",
                *STEPS,
                "times less",
                "wall s, plain",
                "wall s, ours",
                "baking",
                "MB, plain",
                "MB, ours",
            ]
        ),
        _row(["---"] * (len(STEPS) + 8)),
        *map(_costs_row, results),
        "",
        f"Median ratio of {len(results)} rooms: {statistics.median(cost.ratio for cost in results):.1f}.",
        "",
        "| step | once per sequence | first view of a frame | further view | factor gained, median |",
        "| --- | --- | --- | --- | --- |",
    ]
    for before, step in zip((None, *STEPS), STEPS, strict=False):
        some = [cost.steps[step] for cost in results]
        once, frame, view = (
            f"{statistics.median(getattr(one, name) for one in some):.2f}"
            for name in ("once_cpu_s", "frame_cpu_s", "view_cpu_s")
        )
        gains = [] if before is None else [c.steps[before].image_cpu_s / c.steps[step].image_cpu_s for c in results]
        lines.append(_row([step, once, frame, view, f"{statistics.median(gains):.2f}" if gains else ""]))
    return lines


def _costs_row(cost: Costs) -> str:
    steps = [f"{cost.steps[name].image_cpu_s:.2f}" for name in STEPS]
    walls = [f"{cost.plain_image_wall_s:.1f}", f"{cost.our_image_wall_s:.1f}"]
    peaks = [f"{cost.plain_peak_mb:.0f}", f"{cost.our_peak_mb:.0f}"]
    return _row([cost.name, str(cost.objects), *steps, f"{cost.ratio:.1f}", *walls, f"{cost.bake_cpu_s:.0f}", *peaks])


def _bake(options: argparse.Namespace, scene: Scene) -> tuple[Path, float]:
    return bake_scene(scene, options.bake_width, options.max_texels)


def _look(options: argparse.Namespace, scenes: list[Scene]) -> list[str]:
    samples = options.samples or 512
    crops: list[Crop] = []
    for scene in scenes:
        baked, config = _bake(options, scene)[0], _config(options, 512, 32)
        render_pair(scene, baked, config, options.pair_samples, None)
        crops += compare_crops(scene, baked, config, options.crop, samples)
    values = [crop.ssim for crop in crops]
    return [
        f"# Original shaders against baked: crops of {options.crop} px of {config.width_px} px at {samples} samples",
        "",
        f"Median SSIM {statistics.median(values):.4f}, least {min(values):.4f}.",
        "",
        _row(["room", "view", "left, top, right, bottom", "SSIM", "mean difference of 255"]),
        _row(["---"] * 5),
        *(
            _row([crop.room, str(crop.camera), str(crop.border_px), f"{crop.ssim:.4f}", f"{crop.mean_difference:.2f}"])
            for crop in crops
        ),
    ]


def _errors(options: argparse.Namespace, scenes: list[Scene]) -> list[str]:
    errors: list[Error] = []
    for scene in scenes:
        baked, config = _bake(options, scene)[0], _config(options, 512, 32)
        errors += measure_errors(scene, baked, config, options.crop)
    width_px = options.width or 512
    fraction = width_px**2 / BUDGET_PX
    return [
        f"# Error at equal time against {REFERENCE_SAMPLES} samples, crops of {options.crop} px of {width_px} px",
        "",
        f"Budgets are for 512 x 512 px; these images get {fraction:.3f} of them, and one sample at least.",
        "",
        _row(["room", "way", "budget, CPU s", "samples", "CPU s of an image", "times the budget", "RMSE"]),
        _row(["---"] * 7),
        *(
            _row(
                [
                    one.room,
                    one.way,
                    f"{one.budget_s:g}",
                    str(one.samples),
                    f"{one.cpu_s:.1f}",
                    f"{one.cpu_s / (fraction * one.budget_s):.1f}",
                    f"{one.rmse:.4f}",
                ]
            )
            for one in errors
        ),
    ]


def _memory(options: argparse.Namespace, scenes: list[Scene]) -> list[str]:
    lines = [_row(["room", "objects", "triangles", "MB"]), _row(["---"] * 4)]
    for scene in scenes:
        path = scene.folder / "memory.json"
        if not path.is_file():
            baked, config = _bake(options, scene)[0], _config(options, 512, 32)
            part = replace(scene.at(config.width_px).first_frames(1), room=replace(scene.room, blend_path=baked))
            few = config.model_copy(update={"samples": 4, "bake": False})
            with spent_by_children() as spent:
                render_views(part.room, part.actors, part.cameras, few, "cpu", scene.folder / "memory", _say_nothing)
            write_json(path, {"mb": spent.peak_mb})
        triangles = sum(len(obj.mesh.faces) for obj in scene.room.objects)
        lines.append(_row([scene.name, str(len(scene.room.objects)), str(triangles), f"{read_json(path)['mb']:.0f}"]))
    return lines


def _say_nothing(done: int, total: int, seconds: float) -> None:
    pass


def _load() -> str:
    return f"{os.getloadavg()[0]:.1f} on {os.cpu_count()} cores"


def _row(cells: list[str]) -> str:
    return f"| {' | '.join(cells)} |"


if __name__ == "__main__":
    main()
