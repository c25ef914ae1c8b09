"""Checks of flow, between frames and between views, and of scene flow, against depth and cameras."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, UInt8

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import SequenceFiles
from perpetua.audit.geometry import NEIGHBOUR_PIXELS, project_to_pixels, to_world, unproject_depth
from perpetua.audit.label_checks import LABELLED
from perpetua.audit.report import Check
from perpetua.audit.tally import Tally, check_of, chosen_frames
from perpetua.audit.visibility_checks import SHARP

NONE, SEEN, HIDDEN, OUTSIDE = range(4)
# Flow agrees with depth and cameras within this many pixels, plus the pixels that this error of depth causes.
FLOW_PX, DEPTH_M = 0.02, 5e-4
# Rounding may move a point this far across the border of an image.
BORDER_PX = 1e-3
# Depth around a point is planar when its inverse bends by less than this fraction.
BEND = 5e-4


@dataclass(frozen=True)
class _Way:
    """Flow from one image to another. ``world_m`` is where the pixels' points are at the other image's time, where
    ``known``."""

    name: str
    flow_px: Float64[np.ndarray, "H W 2"]
    state: UInt8[np.ndarray, "H W"]
    depth_m: Float64[np.ndarray, "H W"]
    world_m: Float64[np.ndarray, "H W 3"]
    known: Bool[np.ndarray, "H W"]
    other_view: str
    other_frame: int


def check_flow(files: SequenceFiles, bounds: AuditConfig) -> list[Check]:
    """Flow to the next frame."""
    return _check("flow", files, bounds, _ways_in_time(files))


def check_view_flow(files: SequenceFiles, bounds: AuditConfig) -> list[Check]:
    """Flow to the other views."""
    return _check("view flow", files, bounds, _ways_between_views(files))


def _ways_in_time(files: SequenceFiles) -> Iterator[_Way]:
    for view in files.views:
        flow = files.arrays[f"{view}/flow.npy"]
        for frame in chosen_frames(len(flow)):
            world_m = world_of_pixels(files, view, frame)
            moved = files.arrays.get(f"{view}/scene_flow.npy")
            still = ~np.asarray(files.arrays[f"{view}/foreground_mask.npy"][frame])
            known = still if moved is None else np.ones_like(still)
            yield _Way(
                f"{view}/flow.npy[{frame}",
                np.asarray(flow[frame], np.float64),
                np.asarray(files.arrays[f"{view}/flow_state.npy"][frame]),
                np.asarray(files.arrays[f"{view}/depth.npy"][frame], np.float64),
                world_m if moved is None else world_m + moved[frame],
                known,
                view,
                frame + 1,
            )


def _ways_between_views(files: SequenceFiles) -> Iterator[_Way]:
    for view in files.views:
        for other in files.views:
            if not {f"{view}/flow_to_{other}.npy", f"{view}/flow_to_{other}_state.npy"} <= set(files.arrays):
                continue
            flow = files.arrays[f"{view}/flow_to_{other}.npy"]
            for frame in chosen_frames(len(flow)):
                depth_m = np.asarray(files.arrays[f"{view}/depth.npy"][frame], np.float64)
                yield _Way(
                    f"{view}/flow_to_{other}.npy[{frame}",
                    np.asarray(flow[frame], np.float64),
                    np.asarray(files.arrays[f"{view}/flow_to_{other}_state.npy"][frame]),
                    depth_m,
                    world_of_pixels(files, view, frame),
                    np.ones(depth_m.shape, bool),
                    other,
                    frame,
                )


def world_of_pixels(files: SequenceFiles, view: str, frame: int) -> Float64[np.ndarray, "H W 3"]:
    """What pixel centres show, in the world."""
    camera_m = unproject_depth(files.arrays[f"{view}/intrinsics.npy"], files.arrays[f"{view}/depth.npy"][frame])
    return to_world(files.arrays[f"{view}/extrinsics_w2c.npy"][frame], camera_m)


class _Rules:
    """The rules that every flow must keep."""

    def __init__(self, bounds: AuditConfig) -> None:
        self.bounds = bounds
        self.has = Tally("has no flow, and depth.npy shows a surface", LABELLED)
        self.empty = Tally("has a flow where there is nothing, or one with state 0", 1.0)
        self.state = Tally("has a state that does not fit where its flow ends", 0.9999)
        self.reach = Tally("is not where depth and cameras take the pixel's point", 0.99)
        self.shown = Tally("is called seen, and depth.npy shows another surface where its flow ends", 0.98)
        self.hidden = Tally("is called hidden, and depth.npy shows its surface where its flow ends", 0.97)

    def apply(self, files: SequenceFiles, way: _Way) -> None:
        """Counts one image's pixels."""
        _, height, width = files.arrays[f"{way.other_view}/depth.npy"].shape
        row, column = np.mgrid[: way.depth_m.shape[0], : way.depth_m.shape[1]]
        end_px = way.flow_px + np.stack([column, row], axis=2)
        expected = _expected(files, way)
        ahead_m, none, nothing = expected[..., 2], way.state == NONE, way.depth_m == 0.0
        self.has.add(way.name, none, ~nothing & ~(way.known & (ahead_m <= 0.0)))
        self.empty.add(way.name, ~none | (way.flow_px != 0.0).any(axis=2), none | nothing)
        off_px = np.maximum(-0.5 - end_px, end_px - np.array([width - 0.5, height - 0.5])).max(axis=2)
        fits = np.where(way.state == OUTSIDE, off_px > -BORDER_PX, off_px < BORDER_PX) & (way.state <= OUTSIDE)
        self.state.add(way.name, ~fits, ~none)
        focal_px = float(files.arrays[f"{way.other_view}/intrinsics.npy"][0])
        on_image = ((way.state == SEEN) | (way.state == HIDDEN)) & way.known
        error_px = np.linalg.norm(end_px - expected[..., :2], axis=2)
        self.reach.add(way.name, ~(error_px <= FLOW_PX + focal_px * DEPTH_M / ahead_m), on_image)
        self._apply_to_depth(files, way, end_px, ahead_m)

    def _apply_to_depth(
        self,
        files: SequenceFiles,
        way: _Way,
        end_px: Float64[np.ndarray, "H W 2"],
        ahead_m: Float64[np.ndarray, "H W"],
    ) -> None:
        around_m, complete = depth_around(files, way.other_view, way.other_frame, end_px)
        allowed_m = self.bounds.depth_tolerance_m + self.bounds.depth_tolerance_share * np.abs(ahead_m)
        near = (ahead_m >= around_m.min(axis=-1) - allowed_m) & (ahead_m <= around_m.max(axis=-1) + allowed_m)
        self.shown.add(way.name, ~near, (way.state == SEEN) & way.known)
        plain = complete & _on_plane(around_m, end_px, ahead_m, SHARP * allowed_m)
        self.hidden.add(way.name, plain, (way.state == HIDDEN) & way.known)


def _on_plane(
    around_m: Float64[np.ndarray, "H W 4"],
    pixel_px: Float64[np.ndarray, "H W 2"],
    depth_m: Float64[np.ndarray, "H W"],
    allowed_m: Float64[np.ndarray, "H W"],
) -> Bool[np.ndarray, "H W"]:
    """Whether four pixel centres show one plane that goes through a depth between them: on a plane the inverse of depth
    is linear over the image."""
    inverse = 1.0 / around_m
    right, down = np.moveaxis(pixel_px - np.floor(pixel_px), 2, 0)
    weight = np.stack([(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down], axis=2)
    bend = inverse[..., 0] + inverse[..., 3] - inverse[..., 1] - inverse[..., 2]
    level = (np.abs(bend) < BEND * inverse[..., 0]) & (around_m.max(axis=2) < 1.1 * around_m.min(axis=2))
    return np.asarray(level & (np.abs(1.0 / (inverse * weight).sum(axis=2) - depth_m) <= allowed_m))


def _expected(files: SequenceFiles, way: _Way) -> Float64[np.ndarray, "H W 3"]:
    """Pixel and depth in the other image of the pixels' points."""
    camera = (
        files.arrays[f"{way.other_view}/intrinsics.npy"],
        files.arrays[f"{way.other_view}/extrinsics_w2c.npy"][way.other_frame],
    )
    return project_to_pixels(*camera, way.world_m.reshape(-1, 3)).reshape(way.world_m.shape)


def _check(name: str, files: SequenceFiles, bounds: AuditConfig, ways: Iterator[_Way]) -> list[Check]:
    rules = _Rules(bounds)
    for way in ways:
        rules.apply(files, way)
    exact = check_of(name, [rules.has, rules.empty, rules.state, rules.reach])
    return [exact, check_of(f"{name} against depth", [rules.shown, rules.hidden])]


def depth_around(
    files: SequenceFiles, view: str, frame: int, pixel_px: Float64[np.ndarray, "*shape 2"]
) -> tuple[Float64[np.ndarray, "*shape 4"], Bool[np.ndarray, "*shape"]]:
    """Depth at the four pixel centres around places in an image (infinite where it shows nothing), clipped to the
    image; and whether all four lie on it."""
    depth_m = np.asarray(files.arrays[f"{view}/depth.npy"][frame], np.float64)
    height, width = depth_m.shape
    corner = np.floor(np.nan_to_num(pixel_px, nan=-9.0, posinf=-9.0, neginf=-9.0).clip(-9.0, 1e9)).astype(np.int64)
    corner = corner[..., None, :] + NEIGHBOUR_PIXELS
    complete = ((corner >= 0) & (corner < [width, height])).all(axis=(-1, -2))
    found_m = depth_m[corner[..., 1].clip(0, height - 1), corner[..., 0].clip(0, width - 1)]
    return np.where(found_m > 0.0, found_m, np.inf), complete


def check_scene_flow(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """Scene flow is 0 except on actors, and moves no point in front of the surfaces that the next frame shows."""
    still = Tally("moves, and foreground_mask.npy shows no actor", 1.0)
    through = Tally("ends before the surface that depth.npy shows in the next frame", 0.98)
    for view in files.views:
        array, depth = files.arrays[f"{view}/scene_flow.npy"], files.arrays[f"{view}/depth.npy"]
        for frame in chosen_frames(len(array)):
            moved_m, name = np.asarray(array[frame], np.float64), f"{view}/scene_flow.npy[{frame}"
            actor = np.asarray(files.arrays[f"{view}/foreground_mask.npy"][frame])
            still.add(name, (moved_m != 0.0).any(axis=2), ~actor | (depth[frame] == 0.0))
            camera = files.arrays[f"{view}/intrinsics.npy"], files.arrays[f"{view}/extrinsics_w2c.npy"][frame + 1]
            world_m = world_of_pixels(files, view, frame)[actor] + moved_m[actor]
            seen = project_to_pixels(*camera, world_m)
            around_m, complete = depth_around(files, view, frame + 1, seen[:, :2])
            allowed_m = bounds.depth_tolerance_m + bounds.depth_tolerance_share * np.abs(seen[:, 2])
            through.add(name, seen[:, 2] < around_m.min(axis=1) - allowed_m, complete & (seen[:, 2] > 0.0))
    return check_of("scene flow", [still, through])
