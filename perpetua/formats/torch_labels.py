"""Labels of every pixel for clips of ``perpetua.formats.torch_dataset``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from perpetua.errors import SequenceFormatError
from perpetua.formats import layout
from perpetua.formats.reader import read_array
from perpetua.formats.resize import PixelCentreResize


def read_labels(
    folder: Path,
    views: tuple[int, ...],
    frames: range,
    length: int,
    labels: tuple[str, ...],
    size_px: tuple[int, int] | None,
) -> dict[str, Tensor]:
    """Labels of a clip, in the form that ``perpetua.formats.torch_dataset.Clip`` describes.

    Args:
        folder: the sequence's.
        views: the clip's.
        frames: the clip's.
        length: frames of the sequence.
        labels: some of ``perpetua.formats.config.OUTPUTS``.
        size_px: width and height to resize to, if at all.

    Raises:
        SequenceFormatError: the sequence was written without a label, or a file is not as it should be.
    """
    reader = _Labels(folder, frames, length, size_px)
    read: dict[str, Tensor] = {}
    if "object_index" in labels:
        index = [reader.read(view, layout.OBJECT_INDEX, np.uint16) for view in views]
        # PyTorch supports few operations on unsigned 16-bit integers.
        read["object_index"] = torch.from_numpy(np.stack(index).astype(np.int64))
    if "normals" in labels:
        read["normals"] = torch.stack([reader.vectors(view, layout.NORMALS, 3) for view in views])
    if "scene_flow" in labels:
        read["scene_flow"] = torch.stack([reader.vectors(view, layout.SCENE_FLOW, 3) for view in views])
    if "flow" in labels:
        flows = [reader.flow(view, layout.FLOW, layout.FLOW_STATE) for view in views]
        read["flow"] = torch.stack([flow for flow, _ in flows])
        read["flow_state"] = torch.stack([state for _, state in flows])
    if "view_flow" in labels:
        between = [reader.flow_to(view, views) for view in views]
        read["view_flow"] = torch.stack([flow for flow, _ in between])
        read["view_flow_state"] = torch.stack([state for _, state in between])
    return read


@dataclass(frozen=True)
class _Labels:
    """Files of a sequence at the frames of a clip."""

    folder: Path
    frames: range
    length: int
    size_px: tuple[int, int] | None

    def read(self, view: int, name: str, dtype: type[np.generic], channels: tuple[int, ...] = ()) -> np.ndarray:
        """A label at its new size; 0 at the sequence's last frame where that has none."""
        path = f"{view}/{name}"
        if not (self.folder / path).exists():
            raise SequenceFormatError(
                f"'{self.folder / path}' is missing: make the sequence with this label in export.outputs, or write it "
                "again with perpetua tracks --label"
            )
        to_next = name in (layout.FLOW, layout.FLOW_STATE, layout.SCENE_FLOW)
        shape = (self.length - to_next, None, None, *channels)
        stored = read_array(self.folder, path, dtype, shape, on_disk=True)
        inside = [frame for frame in self.frames if frame < len(stored)]
        pictures = np.asarray(stored[inside])
        pictures = np.moveaxis(pictures, -1, 1) if channels else pictures
        resized = self._resize(stored).nearest(pictures)
        missing = np.zeros((len(self.frames) - len(inside), *resized.shape[1:]), dtype)
        return np.concatenate([resized, missing])

    def vectors(self, view: int, name: str, channels: int) -> Tensor:
        """A label with channels, which are put before rows."""
        return torch.from_numpy(self.read(view, name, np.float32, (channels,)))

    def flow(self, view: int, flow_name: str, state_name: str) -> tuple[Tensor, Tensor]:
        """Flow in pixels of the resized images, and its states."""
        stored = read_array(self.folder, f"{view}/{state_name}", np.uint8, (None, None, None), on_disk=True)
        scale = torch.from_numpy(self._resize(stored).scale).float()
        flow = self.vectors(view, flow_name, 2) * scale[:, None, None]
        return flow, torch.from_numpy(self.read(view, state_name, np.uint8))

    def flow_to(self, view: int, others: tuple[int, ...]) -> tuple[Tensor, Tensor]:
        """Flow from a view to each of several, and its states; nothing to itself."""
        found = {
            other: self.flow(view, layout.view_flow(other), layout.view_flow_state(other))
            for other in others
            if other != view
        }
        flow, state = next(iter(found.values()))
        found[view] = torch.zeros_like(flow), torch.zeros_like(state)
        return torch.stack([found[other][0] for other in others]), torch.stack([found[other][1] for other in others])

    def _resize(self, stored: np.ndarray) -> PixelCentreResize:
        stored_px = (stored.shape[2], stored.shape[1])
        return PixelCentreResize(stored_px, self.size_px or stored_px)
