"""Writer of the optional outputs: labels of every pixel; ``perpetua.formats.layout`` lists its files."""

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.formats import layout
from perpetua.formats.frame_file import FrameFile
from perpetua.labels.motion import PixelFlow, flow, normals, scene_flow_m
from perpetua.labels.pixels import LabelledScene, PixelSurfaces
from perpetua.scene.scene import Scene


@dataclass(frozen=True)
class LabelReport:
    """Pixels that show something, over all views and frames, and those of them that have a label."""

    shown: int = 0
    labelled: int = 0


def write_labels(folder: Path, scene: Scene, outputs: tuple[str, ...]) -> LabelReport:
    """Writes the chosen outputs of all views beside a sequence's other files, frame by frame.

    Args:
        folder: the sequence's, with a folder for each view.
        scene: what was rendered.
        outputs: some of ``perpetua.formats.config.OUTPUTS``.
    """
    if "object_index" in outputs:
        for index, view in enumerate(scene.views):
            shape = view.object_index.shape
            with FrameFile(folder / str(index) / layout.OBJECT_INDEX, shape, np.uint16) as file:
                for shown in view.object_index:
                    file.append(np.asarray(shown))
    wanted = frozenset(outputs) - {"object_index"}
    if not wanted:
        return LabelReport()
    labelled_scene = LabelledScene(scene)
    shown = labelled = 0
    for index, view in enumerate(scene.views):
        labelled += _write_view(folder / str(index), labelled_scene, index, wanted)
        shown += sum(int((np.asarray(depth_m) > 0.0).sum()) for depth_m in view.depth_m)
    return LabelReport(shown, labelled)


@dataclass
class _Picture:
    """A file, and its current frame, into which labels are entered pixel by pixel."""

    file: FrameFile
    frame: np.ndarray

    def enter(self, surfaces: PixelSurfaces, values: np.ndarray) -> None:
        self.frame.reshape(-1, *self.frame.shape[2:])[surfaces.pixel] = values

    def finish(self) -> None:
        self.file.append(self.frame)
        self.frame[:] = 0


def _write_view(folder: Path, scene: LabelledScene, view: int, wanted: frozenset[str]) -> int:
    """Returns how many pixels were labelled."""
    frames, labelled = scene.scene.frames, 0
    with ExitStack() as stack:
        pictures = {
            name: stack.enter_context(FrameFile(folder / name, (count, *shape), dtype))
            for name, (count, shape, dtype) in _files(scene, view, wanted).items()
        }
        current = {name: _Picture(file, np.zeros(file.shape[1:], file.dtype)) for name, file in pictures.items()}
        for frame in range(frames):
            for block in scene.blocks(view):
                surfaces = scene.surfaces(view, frame, block)
                labelled += len(surfaces.pixel)
                for name, values in _labels(scene, surfaces, wanted).items():
                    current[name].enter(surfaces, values)
            for name, picture in current.items():
                # There is no way from the last frame to a next one.
                if frame < pictures[name].shape[0]:
                    picture.finish()
    return labelled


def _files(
    scene: LabelledScene, view: int, wanted: frozenset[str]
) -> dict[str, tuple[int, tuple[int, ...], type[np.generic]]]:
    """Frames, shape of one, and type of each file of a view."""
    intrinsics, frames = scene.cameras[view].intrinsics, scene.scene.frames
    size = (intrinsics.height_px, intrinsics.width_px)
    files: dict[str, tuple[int, tuple[int, ...], type[np.generic]]] = {}
    if "normals" in wanted:
        files[layout.NORMALS] = (frames, (*size, 3), np.float32)
    if "scene_flow" in wanted:
        files[layout.SCENE_FLOW] = (frames - 1, (*size, 3), np.float32)
    if "flow" in wanted:
        files[layout.FLOW] = (frames - 1, (*size, 2), np.float32)
        files[layout.FLOW_STATE] = (frames - 1, size, np.uint8)
    if "view_flow" in wanted:
        for other in _other_views(scene, view):
            files[layout.view_flow(other)] = (frames, (*size, 2), np.float32)
            files[layout.view_flow_state(other)] = (frames, size, np.uint8)
    return files


def _other_views(scene: LabelledScene, view: int) -> list[int]:
    return [other for other in range(len(scene.cameras)) if other != view]


def _labels(scene: LabelledScene, surfaces: PixelSurfaces, wanted: frozenset[str]) -> dict[str, np.ndarray]:
    """The values of each file at the pixels of a block."""
    view, frame = surfaces.view, surfaces.frame
    labels: dict[str, np.ndarray] = {}
    if "normals" in wanted:
        labels[layout.NORMALS] = normals(scene, surfaces)
    if "view_flow" in wanted:
        for other in _other_views(scene, view):
            names = layout.view_flow(other), layout.view_flow_state(other)
            labels |= _flow_labels(flow(scene, surfaces, other, frame), *names)
    # Last, because it moves the meshes on.
    if frame + 1 < scene.scene.frames:
        if "scene_flow" in wanted:
            labels[layout.SCENE_FLOW] = scene_flow_m(surfaces, frame + 1)
        if "flow" in wanted:
            labels |= _flow_labels(flow(scene, surfaces, view, frame + 1), layout.FLOW, layout.FLOW_STATE)
    return labels


def _flow_labels(found: PixelFlow, flow_name: str, state_name: str) -> dict[str, np.ndarray]:
    return {flow_name: found.flow_px, state_name: found.state}
