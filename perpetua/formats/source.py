"""What an exporter is: it writes a finished sequence once more, in the layout of another reader."""

import colorsys
from collections import Counter
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from jaxtyping import Float32, Float64, Int64, UInt16

from perpetua.errors import SequenceFormatError
from perpetua.formats.reader import Sequence, SequenceView
from perpetua.geometry.transforms import transform_points
from perpetua.registry import Registry
from perpetua.scene.scene import Scene

PERSON = "person"
# Corner of the top-left pixel as origin, where ours is its centre: what other readers add to our pixels.
HALF_PIXEL_PX = 0.5


@dataclass(frozen=True)
class ExportSource:
    """A finished sequence; with the rendered object index, one array per view, and meshes where they are kept."""

    name: str
    sequence: Sequence
    object_index: tuple[UInt16[np.ndarray, "F H W"], ...] | None = None
    meshes: Scene | None = None

    @cached_property
    def record(self) -> dict[str, Any]:
        """The content of ``sequence.json``; empty where there is none."""
        return self.sequence.record or {}

    @property
    def fps(self) -> float:
        """Frames per second; 24 where the sequence does not say."""
        return float(self.record.get("fps", 24.0))

    def track_camera_m(self, view: int) -> Float64[np.ndarray, "F P 3"]:
        """World positions of the tracks in the coordinates (OpenCV axes) of a view's moving camera, in metres."""
        pose = self.sequence.views[view].camera_from_world.astype(np.float64)
        return transform_points(pose, self.sequence.tracks_m.astype(np.float64))

    def track_pixel_px(self, view: int) -> Float64[np.ndarray, "F P 2"]:
        """Our pixels of the tracks in a view; a point behind the camera has the mirrored pixel of its line of sight."""
        camera_m = self.track_camera_m(view)
        fx_px, fy_px, cx_px, cy_px = self.sequence.views[view].intrinsics_px.astype(np.float64)
        return camera_m[..., :2] / camera_m[..., 2:] * np.array([fx_px, fy_px]) + np.array([cx_px, cy_px])

    @cached_property
    def track_object(self) -> Int64[np.ndarray, " P"]:
        """Object index of each track; without a record 1 if most pixels that show it are foreground, else 0."""
        count = self.sequence.tracks_m.shape[1]
        recorded = self.record.get("tracks", {}).get("object_index")
        if recorded is not None:
            if len(recorded) != count:
                raise SequenceFormatError(
                    f"sequence.json of '{self.sequence.folder}' names the objects of {len(recorded)} tracks and there "
                    f"are {count}: take sequence.json away, or make the sequence again"
                )
            return np.array(recorded, np.int64)
        votes = np.zeros(count, np.int64)
        for index, view in enumerate(self.sequence.views):
            if view.foreground is not None:
                frame, track = np.nonzero(view.visible)
                column, row = np.rint(self.track_pixel_px(index)[frame, track]).astype(np.int64).T
                _, height_px, width_px = view.foreground.shape
                shown = view.foreground[frame, row.clip(0, height_px - 1), column.clip(0, width_px - 1)]
                np.add.at(votes, track, np.where(shown, 1, -1))
        return (votes > 0).astype(np.int64)

    @cached_property
    def object_name(self) -> dict[int, str]:
        """Names of the objects in ``sequence.json``, by object index; a name that several share gets the index."""
        named = {int(obj["object_index"]): str(obj.get("name", obj["category"])) for obj in self._objects}
        shared = Counter(named.values())
        return {index: name if shared[name] == 1 else f"{name}_{index}" for index, name in named.items()}

    @cached_property
    def people(self) -> frozenset[int]:
        """Object indices of the people; without a record 1, by the rule of ``track_object``."""
        if not self._objects:
            return frozenset({1})
        return frozenset(int(obj["object_index"]) for obj in self._objects if obj["category"] == PERSON)

    def object_colour(self, index: int) -> tuple[int, int, int]:
        """A colour that tells an object from others: people bright, objects pale."""
        # Steps of the golden ratio keep neighbouring indices far apart in hue.
        person = index in self.people
        red, green, blue = colorsys.hsv_to_rgb(index * 0.618034 % 1.0, 0.9 if person else 0.35, 1.0 if person else 0.8)
        return round(255 * red), round(255 * green), round(255 * blue)

    @property
    def _objects(self) -> list[dict[str, Any]]:
        return list(self.record.get("objects", []))

    def depth_m(self, view: int, frame: int) -> Float32[np.ndarray, "H W"]:
        """Depth of a frame along Z, 0 for none.

        Raises:
            SequenceFormatError: the sequence was written without depth.
        """
        depth_m = self.sequence.views[view].depth_m
        if depth_m is None:
            raise SequenceFormatError(
                f"'{self.sequence.folder}' view {view} has no depth.npy, which this format needs: make the sequence "
                "again with depth, or choose another --format"
            )
        return np.asarray(depth_m[frame])


def image_size_px(view: SequenceView) -> tuple[int, int]:
    """Width and height of a view's images, from the first one."""
    height_px, width_px = view.image(0).shape[:2]
    return int(width_px), int(height_px)


class Exporter(Protocol):
    """Writes finished sequences in one layout."""

    def write(self, source: ExportSource, folder: Path) -> None:
        """Writes the files of one sequence into ``folder``, which exists; sequences of other names may lie beside.

        Raises:
            SequenceFormatError: the sequence lacks what the layout holds, or cannot be said in it.
            EnvironmentSetupError: a library that the layout needs is not installed.
        """
        ...


EXPORTERS: Registry[type[Exporter]] = Registry(
    "export format",
    "perpetua.exporters",
    {
        "kubric": "perpetua.formats.kubric:Kubric",
        "rerun": "perpetua.formats.rerun_recording:RerunRecording",
        "tapvid3d": "perpetua.formats.tapvid3d:Tapvid3d",
    },
)
"""Exporters by the name that ``perpetua export --format`` takes."""
