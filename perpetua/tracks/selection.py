"""Which candidates become tracks: those that spread best over objects, image area, views and time."""

import numpy as np
from jaxtyping import Bool, Int32, Int64
from scipy.sparse import csr_matrix

from perpetua.geometry.pinhole import project
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.scene.camera import CameraPath
from perpetua.tracks.surface import BoundPoints

IMAGE_CELLS = 8
TIMES = 16
ROUNDS = 64
JITTER = 0.1
# How much spreading over objects counts beside spreading over the images.
OBJECT_WEIGHT = 4.0


def spread(
    wanted: int,
    object_index: Int32[np.ndarray, " N"],
    cells: csr_matrix,
    rng: np.random.Generator,
    reserved: Bool[np.ndarray, " N"] | None = None,
    least: int = 0,
) -> Int64[np.ndarray, " M"]:
    """Chooses ``wanted`` candidates greedily, a batch at a time, best first.

    A candidate is worth more where few were chosen before: in the image cells it is seen in, and on its object.
    An object's share grows with the root of its candidates, so that walls do not crowd out small objects.

    Args:
        wanted: how many to choose, at most the number of candidates.
        object_index: object of each candidate.
        cells: candidates x (view, time, image cell), 1 where the candidate is seen; see ``seen_cells``.
        rng: breaks ties.
        reserved: candidates of which at least ``least`` are chosen, or all if they are fewer.
    """
    _, obj, candidates_of = np.unique(object_index, return_inverse=True, return_counts=True)
    obj, appetite = obj.reshape(-1), np.sqrt(candidates_of.astype(np.float64))
    seen_in = np.maximum(np.asarray(cells.sum(axis=1)).reshape(-1), 1.0)
    in_cell, on_object = np.zeros(cells.shape[1]), np.zeros(len(appetite))
    chosen: list[Int64[np.ndarray, " B"]] = []
    taken = np.zeros(len(object_index), bool)
    appetite *= OBJECT_WEIGHT / appetite.max(initial=1.0)
    closed = np.zeros(len(taken), bool) if reserved is None else ~reserved
    least = min(least, wanted, int((~closed).sum()))
    for size, only_reserved in [*_batches(least, wanted, True), *_batches(wanted - least, wanted, False)]:
        gain = cells @ (1.0 / (1.0 + in_cell)) / seen_in
        gain += (appetite / (1.0 + on_object))[obj]
        gain *= 1.0 + JITTER * rng.random(len(gain))
        gain[taken | (closed & only_reserved)] = -1.0
        best = np.argsort(-gain, kind="stable")[:size]
        chosen.append(best)
        taken[best] = True
        in_cell += np.asarray(cells[best].sum(axis=0)).reshape(-1)
        on_object += np.bincount(obj[best], minlength=len(on_object))
    return np.concatenate([np.zeros(0, np.int64), *chosen])


def _batches(count: int, wanted: int, only_reserved: bool) -> list[tuple[int, bool]]:
    """Sizes of batches of about a ``ROUNDS``-th of what is wanted in all."""
    rounds = min(count, -(-ROUNDS * count // max(wanted, 1)))
    return [(len(batch), only_reserved) for batch in np.array_split(np.arange(count), rounds)] if rounds else []


def seen_cells(
    bound: BoundPoints,
    cameras: tuple[CameraPath, ...],
    frames: Int64[np.ndarray, " S"],
    visible: Bool[np.ndarray, "C S N"],
) -> csr_matrix:
    """Candidates x (view, time, image cell) at up to ``TIMES`` of the frames: 1 where the candidate is seen."""
    views, scanned, count = visible.shape
    times = np.unique(np.linspace(0, scanned - 1, TIMES).round().astype(int))
    position_m = [bound.point_m(frame) for frame in frames[times].tolist()]
    rows: list[Int64[np.ndarray, " B"]] = []
    columns: list[Int64[np.ndarray, " B"]] = []
    for view, camera in enumerate(cameras):
        camera_from_world = invert_rigid(camera.world_from_camera)
        size_px = np.array([camera.intrinsics.width_px, camera.intrinsics.height_px])
        for place, time in enumerate(times.tolist()):
            seen = np.flatnonzero(visible[view, time])
            camera_m = transform_points(camera_from_world[frames[time]], position_m[place][seen])
            fraction = (project(camera.intrinsics, camera_m) + 0.5) / size_px
            cell = np.clip((fraction * IMAGE_CELLS).astype(np.int64), 0, IMAGE_CELLS - 1)
            rows.append(seen)
            columns.append(((view * len(times) + place) * IMAGE_CELLS + cell[:, 1]) * IMAGE_CELLS + cell[:, 0])
    row, column = np.concatenate(rows), np.concatenate(columns)
    return csr_matrix((np.ones(len(row)), (row, column)), shape=(count, views * len(times) * IMAGE_CELLS**2))
