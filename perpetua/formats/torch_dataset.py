"""Finished sequences as a ``torch.utils.data.Dataset`` of clips.

::

    folders = sorted(Path("out/train").iterdir())
    clips = SequenceDataset(folders, views=(0, 2), clip_frames=24, size_px=(256, 256))
    for clip in DataLoader(clips, batch_size=None, num_workers=4):
        ...

A data set holds names and numbers alone, opens files per clip and draws nothing at random, so any number of workers may
share it. Batches of several clips need clips of one shape: the same numbers of tracks and views, one ``size_px``.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from jaxtyping import Bool, Float32, Float64, Int64, UInt8
from torch import Tensor
from torch.utils.data import Dataset

from perpetua.errors import InputError, SequenceFormatError
from perpetua.formats import layout
from perpetua.formats.config import OUTPUTS
from perpetua.formats.reader import SequenceView, read_array, read_view, view_names
from perpetua.formats.resize import PixelCentreResize
from perpetua.formats.torch_labels import read_labels
from perpetua.geometry.transforms import transform_points
from perpetua.tracks.queries import draw_queries
from perpetua.tracks.types import ViewTracks


class Clip(NamedTuple):
    """Some frames of some views of a sequence. V views, T frames, P tracks, images of H rows and W columns.

    Pixel (0, 0) is the centre of the top-left pixel of the images as they are here, resized or not.

    Attributes:
        name: of the sequence's folder.
        views: which of the sequence's views these are.
        frames: which of the sequence's frames these are.
        images: RGB, 0..255.
        depth_m: metres along Z at pixel centres, 0 for none; when resized, of the nearest pixel. Hd and Wd are H and W,
            or 0 in a data set without depth.
        foreground: true on people; Hf and Wf as for depth.
        intrinsics_px: the matrix with fx, fy, cx, cy.
        camera_from_world: world to camera, OpenCV axes.
        tracks_m: world positions.
        pixel_px: x, y of the tracks in each view; NaN behind the camera.
        visible: whether a view sees a track.
        queries_xytv: x, y, frame, view at which each track is asked for, frame and view counted within the clip. The
            sequence's own queries for the whole of it; otherwise drawn anew by the sequence's rule among what the clip
            sees, and NaN for tracks that it never sees.
        labels: the labels of every pixel that were asked for, channels before rows; when resized, of the nearest pixel.
            See ``perpetua.formats.layout`` for what they mean.

            ``object_index`` (V,T,H,W) int64; ``normals`` (V,T,3,H,W); ``scene_flow`` (V,T,3,H,W); ``flow`` (V,T,2,H,W)
            with ``flow_state`` (V,T,H,W) uint8; ``view_flow`` (V,V,T,2,H,W) from the first to the second of the clip's
            views with ``view_flow_state`` (V,V,T,H,W), where a view's flow to itself is 0 and has state 0. Flow leads
            to the next frame of the sequence; its last frame has none: 0, with state 0.
    """

    name: str
    views: Int64[Tensor, " V"]
    frames: Int64[Tensor, " T"]
    images: UInt8[Tensor, "V T 3 H W"]
    depth_m: Float32[Tensor, "V T Hd Wd"]
    foreground: Bool[Tensor, "V T Hf Wf"]
    intrinsics_px: Float32[Tensor, "V 3 3"]
    camera_from_world: Float32[Tensor, "V T 4 4"]
    tracks_m: Float32[Tensor, "T P 3"]
    pixel_px: Float32[Tensor, "V T P 2"]
    visible: Bool[Tensor, "V T P"]
    queries_xytv: Float32[Tensor, "P 4"]
    labels: dict[str, Tensor]


@dataclass(frozen=True)
class _ClipPlace:
    """The frames and views that a clip reads; ``length`` is the number of frames of its sequence."""

    folder: Path
    views: tuple[int, ...]
    frames: range
    length: int


class SequenceDataset(Dataset[Clip]):
    """Clips of sequences in the benchmark layout.

    Args:
        folders: sequence folders; their order is the order of the clips.
        views: views of each clip, in this order; None for all.
        clip_frames: frames of a clip; None for the whole sequence.
        clip_stride: frames between the starts of a sequence's clips; None for clips that do not overlap.
        frame_step: 2 takes every second frame, and so on; a clip then spans ``(clip_frames - 1) * frame_step + 1``.
        size_px: width and height of images; None leaves them as they are. The centres of corner pixels stay so, see
            ``perpetua.formats.resize``.
        depth: whether clips have depth.
        foreground: whether clips have masks of the people.
        labels: which labels of every pixel clips have, some of ``perpetua.formats.config.OUTPUTS``.

    Raises:
        InputError: a setting does not fit a sequence.
        SequenceFormatError: a folder is not a sequence.
    """

    def __init__(
        self,
        folders: Iterable[Path],
        *,
        views: tuple[int, ...] | None = None,
        clip_frames: int | None = None,
        clip_stride: int | None = None,
        frame_step: int = 1,
        size_px: tuple[int, int] | None = None,
        depth: bool = True,
        foreground: bool = True,
        labels: tuple[str, ...] = (),
    ) -> None:
        if not set(labels) <= set(OUTPUTS):
            raise InputError(f"labels must be among {', '.join(OUTPUTS)}, not {', '.join(labels)}")
        if frame_step > 1 and {"flow", "scene_flow"} & set(labels):
            raise InputError(f"flow leads to the next frame, so frame_step must be 1 with it, not {frame_step}")
        if views is not None and len(set(views)) < 2 and "view_flow" in labels:
            raise InputError(f"view_flow leads from view to view, so at least two views are required, not {views}")
        wanted = {"clip_frames": clip_frames, "clip_stride": clip_stride, "frame_step": frame_step}
        for setting, value in wanted.items():
            if value is not None and value < 1:
                raise InputError(f"{setting} must be at least 1, not {value}")
        self.size_px, self.depth, self.foreground, self.labels = size_px, depth, foreground, labels
        self._places = [
            place
            for folder in folders
            for place in _places_of(Path(folder), views, clip_frames, clip_stride, frame_step)
        ]

    def __len__(self) -> int:
        return len(self._places)

    def __getitem__(self, index: int) -> Clip:
        """Reads, decodes and resizes a clip.

        Raises:
            SequenceFormatError: a file is missing, damaged, or not of the layout's type and shape.
        """
        place = self._places[index]
        frames = np.array(place.frames, np.int64)
        all_tracks_m = read_array(place.folder, layout.TRACKS, np.float32, (None, None, 3), on_disk=True)
        tracks_m = np.array(all_tracks_m[frames])
        count = tracks_m.shape[1]
        parts = [
            self._read_part(read_view(place.folder, str(view), place.length, count), frames, tracks_m, place, view)
            for view in place.views
        ]
        pixel_px = np.stack([part.pixel_px for part in parts])
        visible = np.stack([part.visible for part in parts])
        return Clip(
            name=place.folder.resolve().name,
            views=torch.tensor(place.views),
            frames=torch.from_numpy(frames),
            images=torch.from_numpy(np.stack([part.images for part in parts])),
            depth_m=torch.from_numpy(np.stack([part.depth_m for part in parts])),
            foreground=torch.from_numpy(np.stack([part.foreground for part in parts])),
            intrinsics_px=torch.from_numpy(np.stack([part.matrix_px for part in parts])).float(),
            camera_from_world=torch.from_numpy(np.stack([part.camera_from_world for part in parts])),
            tracks_m=torch.from_numpy(tracks_m),
            pixel_px=torch.from_numpy(pixel_px).float(),
            visible=torch.from_numpy(visible),
            queries_xytv=torch.from_numpy(_queries(place, np.stack([part.scale for part in parts]), pixel_px, visible)),
            labels=read_labels(place.folder, place.views, place.frames, place.length, self.labels, self.size_px),
        )

    def _read_part(
        self,
        view: SequenceView,
        frames: Int64[np.ndarray, " T"],
        tracks_m: Float32[np.ndarray, "T P 3"],
        place: _ClipPlace,
        index: int,
    ) -> "_ViewPart":
        images = np.stack([view.image(frame) for frame in frames.tolist()])
        height_px, width_px = images.shape[1:3]
        resize = PixelCentreResize((width_px, height_px), self.size_px or (width_px, height_px))
        camera_from_world = view.camera_from_world[frames]
        fx_px, fy_px, cx_px, cy_px = view.intrinsics_px.astype(np.float64) * np.tile(resize.scale, 2)
        camera_m = transform_points(camera_from_world.astype(np.float64), tracks_m.astype(np.float64))
        depth_m = np.where(camera_m[..., 2:] > 0.0, camera_m[..., 2:], np.nan)
        if self.size_px is not None:
            images = np.stack([resize.image(image) for image in images])
        return _ViewPart(
            images=np.ascontiguousarray(np.moveaxis(images, 3, 1)),
            depth_m=_pictures(
                view.depth_m, np.float32, self.depth, frames, resize, f"{place.folder}/{index}/depth.npy"
            ),
            foreground=_pictures(
                view.foreground,
                np.bool_,
                self.foreground,
                frames,
                resize,
                f"{place.folder}/{index}/foreground_mask.npy",
            ),
            matrix_px=np.array([[fx_px, 0.0, cx_px], [0.0, fy_px, cy_px], [0.0, 0.0, 1.0]]),
            camera_from_world=camera_from_world,
            pixel_px=camera_m[..., :2] / depth_m * np.array([fx_px, fy_px]) + np.array([cx_px, cy_px]),
            visible=view.visible[frames],
            scale=resize.scale,
        )


@dataclass(frozen=True)
class _ViewPart:
    """The arrays of one view in a clip."""

    images: UInt8[np.ndarray, "T 3 H W"]
    depth_m: Float32[np.ndarray, "T Hd Wd"]
    foreground: Bool[np.ndarray, "T Hf Wf"]
    matrix_px: Float64[np.ndarray, "3 3"]
    camera_from_world: Float32[np.ndarray, "T 4 4"]
    pixel_px: Float64[np.ndarray, "T P 2"]
    visible: Bool[np.ndarray, "T P"]
    scale: Float64[np.ndarray, "2"]


def _pictures(
    stored: np.ndarray | None,
    dtype: type[np.generic],
    wanted: bool,
    frames: Int64[np.ndarray, " T"],
    resize: PixelCentreResize,
    path: str,
) -> np.ndarray:
    if not wanted:
        return np.zeros((len(frames), 0, 0), dtype)
    if stored is None:
        raise SequenceFormatError(f"'{path}' is missing: a data set without it takes depth=False or foreground=False")
    return np.ascontiguousarray(resize.nearest(np.asarray(stored[frames])))


def _places_of(
    folder: Path, views: tuple[int, ...] | None, clip_frames: int | None, clip_stride: int | None, frame_step: int
) -> list[_ClipPlace]:
    length = len(read_array(folder, layout.TRACKS, np.float32, (None, None, 3), on_disk=True))
    known = len(view_names(folder))
    if views is not None and not set(views) <= set(range(known)):
        raise InputError(f"views must be among 0..{known - 1} of '{folder}', not {views}")
    span = length if clip_frames is None else (clip_frames - 1) * frame_step + 1
    if span > length:
        raise InputError(f"a clip spans {span} frames and '{folder}' has {length}: lower clip_frames or frame_step")
    chosen = tuple(range(known)) if views is None else views
    starts = range(0, length - span + 1, span if clip_stride is None else clip_stride)
    return [_ClipPlace(folder, chosen, range(start, start + span, frame_step), length) for start in starts]


def _queries(
    place: _ClipPlace,
    scale: Float64[np.ndarray, "V 2"],
    pixel_px: Float64[np.ndarray, "V T P 2"],
    visible: Bool[np.ndarray, "V T P"],
) -> Float32[np.ndarray, "P 4"]:
    count = visible.shape[2]
    if len(place.frames) == place.length and place.views == tuple(range(len(view_names(place.folder)))):
        own = read_array(place.folder, layout.QUERIES, np.float32, (count, 4)).astype(np.float64)
        own[:, :2] *= scale[own[:, 3].astype(np.int64)]
        return own.astype(np.float32)
    queries_xytv = np.full((count, 4), np.nan, np.float32)
    seen = visible.any(axis=(0, 1))
    depth_m = np.full((*visible.shape[:2], int(seen.sum())), np.nan)
    queries_xytv[seen] = draw_queries(ViewTracks(pixel_px[:, :, seen], depth_m, visible[:, :, seen]))
    return queries_xytv
