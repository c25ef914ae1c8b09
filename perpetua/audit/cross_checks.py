"""Checks that files agree with each other: views with views, labels with tracks."""

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import SequenceFiles
from perpetua.audit.flow_checks import depth_around, world_of_pixels
from perpetua.audit.geometry import NEIGHBOUR_PIXELS, project_to_pixels
from perpetua.audit.report import Check
from perpetua.audit.tally import Tally, check_of, chosen_frames

# About this many pixels along each side of an image are tested in the other views.
LOOKED_AT_PX = 128
# Largest difference between a track and the labels at the pixel centres around it.
MOVES_M, MOVES_FRACTION = 0.01, 0.2
FLOWS_PX, FLOWS_FRACTION = 0.5, 0.1
TURNED_COSINE = 0.7


def check_views_agree(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """No view sees through a surface that another view shows: the point that a pixel's depth gives is never nearer to
    another camera than the surface which that camera shows in the point's direction."""
    through = Tally("shows a surface that another view sees through", 1.0 - bounds.seen_through)
    for view in files.views:
        for frame in chosen_frames(len(files.arrays[f"{view}/depth.npy"])):
            _, height, width = files.arrays[f"{view}/depth.npy"].shape
            stride = max(1, max(height, width) // LOOKED_AT_PX)
            shown = np.asarray(files.arrays[f"{view}/depth.npy"][frame, ::stride, ::stride]) > 0.0
            world_m = world_of_pixels(files, view, frame)[::stride, ::stride]
            for other in files.views:
                if other != view:
                    before, tested = _before_surfaces(files, other, frame, world_m, bounds)
                    through.add(
                        f"{view}/depth.npy[{frame} (every {stride}th pixel), view {other}", before, tested & shown
                    )
    return check_of("views agree", [through])


def _before_surfaces(
    files: SequenceFiles, view: str, frame: int, world_m: Float64[np.ndarray, "H W 3"], bounds: AuditConfig
) -> tuple[Bool[np.ndarray, "H W"], Bool[np.ndarray, "H W"]]:
    """Which points are nearer than the surface that a view shows there, and which of them project into the view."""
    intrinsics = files.arrays[f"{view}/intrinsics.npy"]
    camera = intrinsics, files.arrays[f"{view}/extrinsics_w2c.npy"][frame]
    seen = project_to_pixels(*camera, world_m.reshape(-1, 3)).reshape(world_m.shape)
    around_m, complete = depth_around(files, view, frame, seen[..., :2])
    ahead_m = seen[..., 2]
    # Between pixel centres a surface may bend by as much as a pixel is wide.
    allowed_m = bounds.depth_tolerance_m + (bounds.depth_tolerance_share + 1.5 / float(intrinsics[0])) * ahead_m
    return ahead_m < around_m.min(axis=-1) - allowed_m, complete & (ahead_m > 0.0)


def check_index_of_tracks(files: SequenceFiles, owner: Int64[np.ndarray, " P"]) -> Check:
    """At least one of the pixel centres around a visible track shows the track's object."""
    shown = Tally("is visible, and object_index.npy shows other objects in all pixels around", 0.999)
    for view in files.views:
        visibility, index = files.arrays[f"{view}/visibility.npy"], files.arrays[f"{view}/object_index.npy"]
        for frame in range(len(visibility)):
            around, on_image = _labels_around(files, view, frame, index[frame])
            own = ((around == owner[:, None]) & on_image).any(axis=1)
            shown.add(f"{view}/visibility.npy[{frame}", ~own, np.asarray(visibility[frame]))
    return check_of("object index of tracks", [shown])


def check_labels_of_tracks(files: SequenceFiles) -> list[Check]:
    """Where a track is visible, the normals and the flow at the pixels around it agree with the track's own."""
    tallies = {
        "normals": Tally("has other normals around it than its triangle in surface_xyz.npy", 0.85),
        "scene flow": Tally("has another scene flow around it than its own way", 0.95),
        "flow": Tally("has another flow around it than its own way in the image", 0.95),
        "view flow": Tally("has another flow to a view around it than its own", 0.95),
    }
    for view in files.views:
        visibility = files.arrays[f"{view}/visibility.npy"]
        for frame in chosen_frames(len(visibility)):
            for kind, agrees in _label_agreement(files, view, frame).items():
                tallies[kind].add(f"{view}/visibility.npy[{frame}", ~agrees, np.asarray(visibility[frame]))
    return [check_of(f"{kind} of tracks", [tally]) for kind, tally in tallies.items() if tally.tested]


def _label_agreement(files: SequenceFiles, view: str, frame: int) -> dict[str, Bool[np.ndarray, " P"]]:
    tracks = files.arrays["tracks_xyz.npy"]
    agreement: dict[str, Bool[np.ndarray, " P"]] = {}
    if f"{view}/normals.npy" in files.arrays and "surface_xyz.npy" in files.arrays:
        around, on_image = _labels_around(files, view, frame, files.arrays[f"{view}/normals.npy"][frame])
        corner_m = np.asarray(files.arrays["surface_xyz.npy"][frame], np.float64)
        normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        normal = normal @ np.asarray(files.arrays[f"{view}/extrinsics_w2c.npy"][frame], np.float64)[:3, :3].T
        cosine = np.abs((around * normal[:, None]).sum(axis=2))
        agreement["normals"] = ((cosine > TURNED_COSINE) & on_image).any(axis=1)
    if frame + 1 < len(tracks) and f"{view}/scene_flow.npy" in files.arrays:
        own_m = (tracks[frame + 1] - tracks[frame]).astype(np.float64)
        moved = files.arrays[f"{view}/scene_flow.npy"][frame]
        agreement["scene flow"] = _flows_alike(files, view, frame, moved, own_m, MOVES_M, MOVES_FRACTION)
    here_px = _pixels(files, view, frame)
    if frame + 1 < len(tracks) and f"{view}/flow.npy" in files.arrays:
        own_px = _pixels(files, view, frame + 1) - here_px
        agreement["flow"] = _flows_alike(
            files, view, frame, files.arrays[f"{view}/flow.npy"][frame], own_px, FLOWS_PX, FLOWS_FRACTION
        )
    for other in files.views:
        if f"{view}/flow_to_{other}.npy" in files.arrays:
            flow = files.arrays[f"{view}/flow_to_{other}.npy"][frame]
            own_px = _pixels(files, other, frame) - here_px
            alike = _flows_alike(files, view, frame, flow, own_px, FLOWS_PX, FLOWS_FRACTION)
            agreement["view flow"] = agreement.get("view flow", alike) & alike
    return agreement


def _flows_alike(
    files: SequenceFiles,
    view: str,
    frame: int,
    flow: np.ndarray,
    own: Float64[np.ndarray, "P D"],
    constant: float,
    fraction: float,
) -> Bool[np.ndarray, " P"]:
    """Whether a label around a track is close to the track's own vector; true where the track has none."""
    around, on_image = _labels_around(files, view, frame, flow)
    length = np.linalg.norm(own, axis=1)
    # The flow of a surface varies near a point by as much as the labels around the point differ from each other.
    spread = np.linalg.norm(around.max(axis=1) - around.min(axis=1), axis=1)
    off = np.linalg.norm(around - own[:, None], axis=2)
    alike = off <= (constant + fraction * length + spread)[:, None]
    return np.asarray((alike & on_image).any(axis=1) | ~np.isfinite(own).all(axis=1))


def _pixels(files: SequenceFiles, view: str, frame: int) -> Float64[np.ndarray, "P 2"]:
    """Pixels of the tracks; NaN behind the camera."""
    camera = files.arrays[f"{view}/intrinsics.npy"], files.arrays[f"{view}/extrinsics_w2c.npy"][frame]
    seen = project_to_pixels(*camera, files.arrays["tracks_xyz.npy"][frame])
    return np.where(seen[:, 2:] > 0.0, seen[:, :2], np.nan)


def _labels_around(
    files: SequenceFiles, view: str, frame: int, picture: np.ndarray
) -> tuple[np.ndarray, Bool[np.ndarray, "P 4"]]:
    """Labels at the four pixel centres around each track, and which of them lie on the image."""
    height, width = picture.shape[:2]
    pixel_px = np.nan_to_num(_pixels(files, view, frame), nan=-9.0).clip(-9.0, 1e9)
    corner = np.floor(pixel_px).astype(np.int64)[:, None] + NEIGHBOUR_PIXELS
    on_image = ((corner >= 0) & (corner < [width, height])).all(axis=2)
    return np.asarray(picture)[corner[..., 1].clip(0, height - 1), corner[..., 0].clip(0, width - 1)], on_image
