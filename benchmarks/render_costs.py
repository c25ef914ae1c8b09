"""What an image costs: the plain loop on the room as made, then one saving after the other up to the render worker."""

import shutil
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from render_scenes import FRAMES, VIEWS, Image, Loop, Rendered, Scene, run_loop, spent_by_children

from perpetua.io.files import read_json, write_json
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.render import render_views

# Frames of ours that are rendered: from the difference of two lengths follow a frame's cost and what is paid once. Both
# are long enough that exposure is metered at as many frames, which is paid once.
SHORT, LONG = 3, 5
STEPS = ("plain loop", "synchronisation", "modifiers", "baking", "sampling")


@dataclass(frozen=True)
class Step:
    """CPU seconds of a way to render: ``once`` per sequence, then for an image that is the first of its frame and
    for a further view of the frame.
    """

    once_cpu_s: float
    frame_cpu_s: float
    view_cpu_s: float

    @property
    def image_cpu_s(self) -> float:
        """An image of a whole sequence, on average."""
        return self.once_cpu_s / (FRAMES * VIEWS) + (self.frame_cpu_s + (VIEWS - 1) * self.view_cpu_s) / VIEWS


@dataclass(frozen=True)
class Costs:
    """One room's costs; ``steps`` by name in the order of ``STEPS``, wall seconds of the first and last, and peaks."""

    name: str
    objects: int
    bake_cpu_s: float
    steps: dict[str, Step]
    plain_image_wall_s: float
    our_image_wall_s: float
    plain_peak_mb: float
    our_peak_mb: float

    @property
    def ratio(self) -> float:
        """How many times fewer CPU seconds an image of ours takes."""
        return self.steps[STEPS[0]].image_cpu_s / self.steps[STEPS[-1]].image_cpu_s


def measure_costs(scene: Scene, config: RenderConfig, baked: Path, bake_cpu_s: float) -> Costs:
    """Renders few images of a scene in every way; a result that is there already is used again.

    The plain loop renders two images, as each costs the same. With data that persist, a first image at one sample
    pays for the scene, and two of the next frame are measured.
    """
    path = scene.folder / f"costs_{config.width_px}_{config.samples}.json"
    if stored := read_json(path):
        return Costs(**{**stored, "steps": {name: Step(**step) for name, step in stored["steps"].items()}})
    scene = replace(scene.at(config.width_px, LONG), folder=scene.folder / f"costs_{config.width_px}")
    images = [Image("first", 1, 0, config.samples), Image("second", 2, 1, config.samples)]
    plain = run_loop(scene, Loop("plain", scene.as_made, False, "blender", True), images, config)
    kept = {
        "synchronisation": _persistent(scene, Loop("kept", scene.as_made, True, "blender", True), config),
        "modifiers": _persistent(scene, Loop("applied", _blend(scene), True, "blender", True), config),
        "baking": _persistent(scene, Loop("baked", baked, True, "blender", True), config),
    }
    kept["baking"] = replace(kept["baking"], once_cpu_s=kept["baking"].once_cpu_s + bake_cpu_s)
    ours, wall_s, peak_mb = _ours(scene, baked, config, bake_cpu_s)
    first, second = plain.images()["first"], plain.images()["second"]
    mean_s = 0.5 * (first["cpu_s"] + second["cpu_s"])
    steps = {"plain loop": Step(plain.one("opened")["cpu_s"], mean_s, mean_s), **kept, "sampling": ours}
    costs = Costs(
        name=scene.name,
        objects=len(scene.room.objects),
        bake_cpu_s=bake_cpu_s,
        steps=steps,
        plain_image_wall_s=0.5 * (first["wall_s"] + second["wall_s"]),
        our_image_wall_s=wall_s,
        plain_peak_mb=plain.one("done")["peak_mb"],
        our_peak_mb=peak_mb,
    )
    write_json(path, asdict(costs))
    return costs


def _blend(scene: Scene) -> Path:
    assert scene.room.blend_path is not None
    return scene.room.blend_path


def _persistent(scene: Scene, loop: Loop, config: RenderConfig) -> Step:
    images = [Image("warm", 0, 0, 1), Image("frame", 1, 0, config.samples), Image("view", 1, 1, config.samples)]
    rendered = run_loop(scene, loop, images, config)
    cost = {stem: event["cpu_s"] for stem, event in rendered.images().items()}
    return Step(_opened_s(rendered) + cost["warm"], cost["frame"], cost["view"])


def _opened_s(rendered: Rendered) -> float:
    return float(rendered.one("opened")["cpu_s"])


def _ours(scene: Scene, baked: Path, config: RenderConfig, bake_cpu_s: float) -> tuple[Step, float, float]:
    """The render worker as the pipeline runs it: its cost, wall seconds of an image, and its peak of memory."""
    room = replace(scene.room, blend_path=baked)
    as_baked = config.model_copy(update={"bake": False})
    spent_s, wall_s, peak_mb = {}, [], 0.0
    for frames in (SHORT, LONG):
        part = scene.first_frames(frames)
        folder = scene.folder / f"ours_{frames}"
        shutil.rmtree(folder, ignore_errors=True)
        with spent_by_children() as spent:
            render_views(
                room, part.actors, part.cameras, as_baked, "cpu", folder, lambda *event: wall_s.append(event[2])
            )
        spent_s[frames] = spent.cpu_s
        peak_mb = max(peak_mb, spent.peak_mb)
    views = len(scene.cameras)
    frame_s = (spent_s[LONG] - spent_s[SHORT]) / (LONG - SHORT)
    once_s = bake_cpu_s + spent_s[SHORT] - frame_s
    return Step(once_s, frame_s / views, frame_s / views), sum(wall_s) / len(wall_s) / views, peak_mb
