"""Checks of labels of every pixel that concern one image: object index and normals."""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.audit.files import SequenceFiles
from perpetua.audit.geometry import unproject_depth
from perpetua.audit.report import Check
from perpetua.audit.tally import Tally, check_of, chosen_frames

# Fraction of the pixels with a surface that must have a label; pixels on silhouettes may have none.
LABELLED = 0.99
UNIT_ERROR = 1e-5
# Pixels with equal normals and planar depth lie on one plane, within this fraction of the depth.
FLAT_FRACTION = 1e-4
SAME_NORMAL = 1.0 - 1e-7
# Depth is planar where its inverse bends by less than this fraction.
LINEAR = 2e-5


def check_object_index(files: SequenceFiles) -> Check:
    """The index names objects of the record, actors exactly where the mask is set, none exactly where depth is 0."""
    listed = [int(obj["object_index"]) for obj in (files.record or {}).get("objects", [])]
    unknown = Tally("is an object that sequence.json does not list", 1.0)
    people = Tally("is an actor or not, and foreground_mask.npy says otherwise", 1.0)
    surface = Tally("is an object or none, and depth.npy says otherwise", 1.0)
    for view in files.views:
        names = (f"{view}/{name}.npy" for name in ("object_index", "foreground_mask", "depth"))
        for frame, (index, mask, depth_m) in enumerate(zip(*(files.arrays[name] for name in names), strict=True)):
            name = f"{view}/object_index.npy[{frame}"
            surface.add(name, (index > 0) != (depth_m > 0.0))
            if files.record is not None:
                unknown.add(name, ~np.isin(index, [0, *listed]))
                people.add(name, np.isin(index, files.actors) != mask)
    return check_of("object index", [unknown, people, surface])


def check_normals(files: SequenceFiles) -> Check:
    """Normals have length 1, face the camera, and are those of the planes that depth shows."""
    has = Tally("has no normal, and depth.npy shows a surface", LABELLED)
    empty = Tally("has a normal, and depth.npy shows nothing", 1.0)
    unit = Tally("must have length 1", 1.0)
    facing = Tally("faces away from the camera", 1.0)
    flat = Tally("is not normal to the plane that depth.npy shows around it", 0.99)
    for view in files.views:
        array, intrinsics = files.arrays[f"{view}/normals.npy"], files.arrays[f"{view}/intrinsics.npy"]
        for frame in chosen_frames(len(array)):
            normal = np.asarray(array[frame], np.float64)
            depth_m = np.asarray(files.arrays[f"{view}/depth.npy"][frame])
            point_m = unproject_depth(intrinsics, depth_m)
            given, name = (normal != 0.0).any(axis=2), f"{view}/normals.npy[{frame}"
            has.add(name, ~given, depth_m > 0.0)
            empty.add(name, given, depth_m == 0.0)
            unit.add(name, np.abs(np.linalg.norm(normal, axis=2) - 1.0) > UNIT_ERROR, given)
            # On an edge-on triangle rounding decides.
            facing.add(name, (normal * point_m).sum(axis=2) > 1e-5 * depth_m, given)
            for bent, tested in _rows_off_plane(files, view, frame, normal, point_m):
                flat.add(name, bent, tested)
    return check_of("normals", [has, empty, unit, facing, flat])


def _rows_off_plane(
    files: SequenceFiles,
    view: str,
    frame: int,
    normal: Float64[np.ndarray, "H W 3"],
    point_m: Float64[np.ndarray, "H W 3"],
) -> Iterator[tuple[Bool[np.ndarray, "*shape"], Bool[np.ndarray, "*shape"]]]:
    """For each three pixels in a row, and in a column: whether the line from the first to the last leaves the plane of
    the middle one's normal, and whether that is tested: all show one object, equal normals and planar depth."""
    index = files.arrays.get(f"{view}/object_index.npy")
    owner = np.zeros(normal.shape[:2]) if index is None else np.asarray(index[frame])
    for axis in (0, 1):
        (first, middle, last), owners, (near, at, far) = (
            [np.take(values, range(start, values.shape[axis] - 2 + start), axis) for start in range(3)]
            for values in (normal, owner, point_m)
        )
        one = (owners[0] == owners[1]) & (owners[1] == owners[2])
        one &= ((first * middle).sum(axis=2) > SAME_NORMAL) & ((middle * last).sum(axis=2) > SAME_NORMAL)
        # On a plane the inverse of depth is linear over the image.
        inverse = [1.0 / points_m[..., 2] for points_m in (near, at, far)]
        one &= np.abs(inverse[0] + inverse[2] - 2.0 * inverse[1]) < LINEAR * inverse[1]
        off_m = np.abs(((far - near) * middle).sum(axis=2))
        yield off_m > FLAT_FRACTION * at[..., 2], one
