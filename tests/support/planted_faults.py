"""Faults that are planted in good data, each with the check that must catch it and what that says."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

Fault = Callable[[Path], None]


def record_hashes(folder: Path) -> None:
    """Makes the record agree with the files, so that a fault has to be found in what the files say."""
    record = json.loads((folder / "sequence.json").read_text())
    record["files"] = {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*.npy")
    }
    (folder / "sequence.json").write_text(json.dumps(record))


def change(name: str, alter: Callable[[np.ndarray], Any]) -> Fault:
    """Loads an array, alters it (in place, or into what ``alter`` returns), and saves it."""

    def plant(folder: Path) -> None:
        array = np.load(folder / name)
        altered = alter(array)
        np.save(folder / name, array if altered is None else altered)

    return plant


def assign(name: str, index: Any, value: Any) -> Fault:
    def alter(array: np.ndarray) -> None:
        array[index] = value

    return change(name, alter)


def swap(first: str, second: str) -> Fault:
    def plant(folder: Path) -> None:
        (folder / first).rename(folder / "aside")
        (folder / second).rename(folder / first)
        (folder / "aside").rename(folder / second)

    return plant


def ray_length(folder: Path) -> None:
    fx, fy, cx, cy = np.load(folder / "0/intrinsics.npy")
    depth = np.load(folder / "0/depth.npy")
    rows, columns = np.mgrid[: depth.shape[1], : depth.shape[2]]
    np.save(
        folder / "0/depth.npy", (depth * np.hypot(np.hypot((columns - cx) / fx, (rows - cy) / fy), 1.0)).astype("f4")
    )


def redraw_queries(folder: Path) -> None:
    """Sound queries of another seed."""
    tracks = np.load(folder / "tracks_xyz.npy").astype(np.float64)
    visible = np.stack([np.load(folder / f"{view}/visibility.npy") for view in range(3)])
    rng = np.random.default_rng(43)
    queries = np.empty((tracks.shape[1], 4), np.float32)
    for track in range(tracks.shape[1]):
        pairs = np.argwhere(visible[:, :, track])
        view, frame = pairs[rng.integers(len(pairs))]
        fx, fy, cx, cy = np.load(folder / f"{view}/intrinsics.npy").astype(np.float64)
        x, y, z, _ = np.load(folder / f"{view}/extrinsics_w2c.npy")[frame].astype(np.float64) @ [
            *tracks[frame, track],
            1,
        ]
        queries[track] = fx * x / z + cx, fy * y / z + cy, frame, view
    np.save(folder / "queries_xytv.npy", queries)


def truncate(name: str) -> Fault:
    def plant(folder: Path) -> None:
        content = (folder / name).read_bytes()
        (folder / name).write_bytes(content[: len(content) * 2 // 3])

    return plant


def images(alter: Callable[[np.ndarray], Any]) -> Fault:
    def plant(folder: Path) -> None:
        path = folder / "1/images_jpeg_bytes.npy"
        jpegs = np.load(path, allow_pickle=True)
        altered = alter(jpegs)
        np.save(path, jpegs if altered is None else altered, allow_pickle=True)

    return plant


def small_image(jpegs: np.ndarray) -> None:
    import cv2

    picture = cv2.imdecode(jpegs[2], cv2.IMREAD_COLOR)
    jpegs[2] = cv2.imencode(".jpg", cv2.resize(picture, (48, 36)))[1].reshape(-1)


def cut_image(jpegs: np.ndarray) -> None:
    jpegs[3] = jpegs[3][:-20]


def remove(name: str) -> Fault:
    def plant(folder: Path) -> None:
        path = folder / name
        if path.is_dir():
            path.rename(folder.with_name(f"removed_{path.name}"))
        else:
            path.unlink()

    return plant


def shrug_dynamic(folder: Path) -> None:
    """Moving tracks stay where they were first, and say that they are still visible."""
    tracks = np.load(folder / "tracks_xyz.npy")
    tracks[:] = tracks[:1]
    np.save(folder / "tracks_xyz.npy", tracks)


def both(*faults: Fault) -> Fault:
    def plant(folder: Path) -> None:
        for fault in faults:
            fault(folder)

    return plant


def turn_into_world(folder: Path) -> None:
    """Normals in the axes of the world."""
    normal, pose = np.load(folder / "0/normals.npy"), np.load(folder / "0/extrinsics_w2c.npy")
    np.save(folder / "0/normals.npy", np.einsum("fji,fhwj->fhwi", pose[:, :3, :3], normal))


def shifted(metres: float) -> Callable[[np.ndarray], None]:
    """Transforms with another translation."""

    def alter(poses: np.ndarray) -> None:
        poses[..., :3, 3] += np.float32(metres)

    return alter


def drift(poses: np.ndarray) -> None:
    """One object creeps by a tenth of a millimetre."""
    poses[:, 2, 0, 3] += np.linspace(0.0, 1e-4, len(poses), dtype=np.float32)


def other_way(name: str) -> Fault:
    """Flow that leads back: from where points are to where they were."""
    return change(name, lambda a: -a)


# Fault, the check that must catch it, and what its message must name.
FAULTS: dict[str, tuple[Fault, str, str]] = {
    "queries half a pixel off": (
        change("queries_xytv.npy", lambda a: a + np.array([0.5, 0.5, 0, 0], np.float32)),
        "query pixels",
        r"queries_xytv.npy\[0\]",
    ),
    "one query 0.01 px off": (
        change("queries_xytv.npy", lambda a: a + np.eye(1, a.size, 28, dtype="f4").reshape(a.shape) * 0.01),
        "query pixels",
        r"queries_xytv.npy\[7\]",
    ),
    "principal point half a pixel off": (
        change("1/intrinsics.npy", lambda a: a + np.array([0, 0, 0.5, 0.5], "f4")),
        "query pixels",
        "and its track is at",
    ),
    "query where the track is hidden": (redraw_queries, "query draw", "the draw gives"),
    "query of a view that does not exist": (assign("queries_xytv.npy", (3, 3), 9), "query pixels", "view 9"),
    "ray length for Z": (ray_length, "depth agreement", r"0/visibility.npy\[0, "),
    "depth half a pixel off": (
        change("0/depth.npy", lambda a: np.roll(a, 1, axis=2)),
        "depth agreement",
        "visible",
    ),
    "depth in centimetres": (change("2/depth.npy", lambda a: a * np.float32(100)), "values", "2/depth.npy"),
    "depth of two views swapped": (swap("0/depth.npy", "1/depth.npy"), "depth agreement", "depth.npy has"),
    "visibility of two views swapped": (swap("0/visibility.npy", "1/visibility.npy"), "query draw", "draw"),
    "views swapped": (swap("0", "1"), "query pixels", "and its track is at"),
    "cameras swapped": (swap("0/extrinsics_w2c.npy", "1/extrinsics_w2c.npy"), "depth agreement", "0/visibility.npy"),
    "depth one frame late": (change("0/depth.npy", lambda a: np.roll(a, 1, axis=0)), "depth agreement", "visible"),
    "tracks one frame late": (
        change("tracks_xyz.npy", lambda a: np.roll(a, 1, axis=0)),
        "on surface",
        r"tracks_xyz.npy\[\d+, \d+\]",
    ),
    "cameras one frame late": (
        change("2/extrinsics_w2c.npy", lambda a: np.roll(a, 1, axis=0)),
        "query pixels",
        "queries",
    ),
    "masks one frame late": (
        change("0/foreground_mask.npy", lambda a: np.roll(a, 1, axis=0)),
        "foreground agreement",
        "0/visibility.npy",
    ),
    "mask inverted": (change("1/foreground_mask.npy", lambda a: ~a), "foreground agreement", "1/visibility.npy"),
    "extrinsics transposed": (
        change("0/extrinsics_w2c.npy", lambda a: np.ascontiguousarray(a.transpose(0, 2, 1))),
        "cameras",
        r"0/extrinsics_w2c.npy\[",
    ),
    "extrinsics from camera to world": (
        change("0/extrinsics_w2c.npy", lambda a: np.linalg.inv(a).astype("f4")),
        "query pixels",
        "queries",
    ),
    "mirrored camera": (
        change("0/extrinsics_w2c.npy", lambda a: np.diag([-1, 1, 1, 1]).astype("f4") @ a),
        "cameras",
        "rigid",
    ),
    "scaled camera": (change("0/extrinsics_w2c.npy", lambda a: a * np.float32(1.01)), "cameras", "rigid"),
    "a block called visible": (
        assign("1/visibility.npy", (slice(1, 4), slice(0, 60)), True),
        "depth agreement",
        "1/visibility.npy",
    ),
    "a block called hidden": (
        assign("1/visibility.npy", (slice(1, 5), slice(0, 90)), False),
        "hidden for a reason",
        "depth shows its surface",
    ),
    "one visibility bit flipped that a query hangs on": (
        change("1/visibility.npy", lambda a: a ^ np.eye(1, a.size, 511, dtype=bool).reshape(a.shape)),
        "query draw",
        "the draw gives",
    ),
    "a track that is never visible": (
        both(*(assign(f"{view}/visibility.npy", (slice(None), 5), False) for view in range(3))),
        "query draw",
        "track 5 is visible nowhere",
    ),
    "truncated tracks": (truncate("tracks_xyz.npy"), "layout", "tracks_xyz.npy"),
    "truncated depth": (truncate("1/depth.npy"), "layout", "1/depth.npy"),
    "truncated images": (truncate("1/images_jpeg_bytes.npy"), "layout", "1/images_jpeg_bytes.npy"),
    "float64 tracks": (change("tracks_xyz.npy", lambda a: a.astype("f8")), "layout", "must be float32, and is float64"),
    "float16 depth": (change("0/depth.npy", lambda a: a.astype("f2")), "layout", "must be float32, and is float16"),
    "integer visibility": (change("0/visibility.npy", lambda a: a.astype("u1")), "layout", "be bool, and is uint8"),
    "Fortran order": (change("tracks_xyz.npy", np.asfortranarray), "layout", "C order"),
    "frames missing in one view": (change("2/visibility.npy", lambda a: a[:-1]), "layout", "visibility.npy must have"),
    "images of one frame missing": (images(lambda a: a[:-1]), "layout", "must hold 6 images, and holds 5"),
    "intrinsics as a matrix": (change("0/intrinsics.npy", lambda a: np.eye(3, dtype="f4")), "layout", "0/intrinsics"),
    "a missing file": (remove("1/foreground_mask.npy"), "layout", "1/foreground_mask.npy is missing"),
    "a missing view": (remove("1"), "layout", "without a gap, and are 0, 2"),
    "NaN in a track": (assign("tracks_xyz.npy", (2, 3, 1), np.nan), "values", r"tracks_xyz.npy\[2, 3, 1\] is nan"),
    "infinite depth": (assign("0/depth.npy", (1, 5, 6), np.inf), "values", r"0/depth.npy\[1, 5, 6\] is inf"),
    "background of 1e10": (assign("0/depth.npy", (1, 5, 6), 1e10), "values", r"0/depth.npy\[1, 5, 6\]"),
    "NaN in a camera": (assign("0/extrinsics_w2c.npy", (1, 0, 0), np.nan), "cameras", "rigid"),
    "a smaller image": (images(small_image), "images", "36x48 and 72x96"),
    "a cut image": (images(cut_image), "images", r"images_jpeg_bytes.npy\[3\] is not a whole JPEG"),
    "static tracks that tremble": (
        change("tracks_xyz.npy", lambda a: a + np.float32(1e-6) * np.arange(6, dtype="f4")[:, None, None]),
        "static tracks",
        r"tracks_xyz.npy\[:, \d+\]",
    ),
    "nothing moves": (shrug_dynamic, "moving tracks", "0.0% of tracks move"),
    "images of two frames swapped": (
        images(lambda a: a[[4, 1, 2, 3, 0, 5]]),
        "images of their frames",
        r"1/images_jpeg_bytes.npy\[(0|4)\] fits frame (4|0) better",
    ),
    "images one frame late": (images(lambda a: np.roll(a, 1)), "images of their frames", "fits frame"),
    "images of views swapped": (
        swap("0/images_jpeg_bytes.npy", "1/images_jpeg_bytes.npy"),
        "images of their frames",
        "of views 0 and 1 fit the other way round",
    ),
    "a camera that stands elsewhere": (
        change("2/extrinsics_w2c.npy", shifted(0.3)),
        "views agree",
        "sees through",
    ),
    "pixels of tracks half a pixel off": (
        change("2/tracks_xy.npy", lambda a: a + np.float32(0.5)), "track pixels", r"2/tracks_xy.npy\[0, 0\]"
    ),
    "pixels of tracks one frame late": (
        change("2/tracks_xy.npy", lambda a: np.roll(a, 1, axis=0)), "track pixels", r"2/tracks_xy.npy\[0, "
    ),
    "pixels of tracks x for y": (
        change("0/tracks_xy.npy", lambda a: np.ascontiguousarray(a[..., ::-1])), "track pixels", "and its track is at"
    ),
    "one pixel of a track missing": (assign("1/tracks_xy.npy", (3, 7), np.nan), "track pixels", r"\[3, 7\] is \[nan"),
    "poses one frame late": (
        change("object_poses.npy", lambda a: np.roll(a, 1, axis=0)), "object poses", "out of object_boxes.npy"
    ),
    "poses transposed": (
        change("object_poses.npy", lambda a: np.ascontiguousarray(a.swapaxes(2, 3))), "object poses", "rigid"
    ),
    "poses from world to object": (
        change("object_poses.npy", lambda a: np.linalg.inv(a).astype("f4")), "object poses", "out of object_boxes"
    ),
    "poses of objects swapped": (
        change("object_poses.npy", lambda a: np.ascontiguousarray(a[:, [0, 2, 1, 3, 4, 5]])),
        "object poses",
        "out of object_boxes",
    ),
    "a pose too few": (change("object_poses.npy", lambda a: a[:, 1:]), "layout", "object_boxes.npy must have shape"),
    "furniture that moves": (
        change("object_poses.npy", drift),
        "object poses",
        r"object_poses.npy\[:, 2\] moves",
    ),
    "object index of views swapped": (
        swap("0/object_index.npy", "1/object_index.npy"), "object index", "foreground_mask.npy says otherwise"
    ),
    "object index one frame late": (
        change("1/object_index.npy", lambda a: np.roll(a, 1, axis=0)), "object index", r"1/object_index.npy\[0, "
    ),
    "object indices mixed up": (
        change("1/object_index.npy", lambda a: np.array([0, 3, 2, 1, 4, 5, 6], np.uint16)[a]),
        "object index of tracks",
        "shows other objects",
    ),
    "an object that nobody listed": (
        assign("1/object_index.npy", (2, 4, 5), 99), "object index", r"\[2, 4, 5\] is an object that sequence.json"
    ),
    "normals of the other side": (change("0/normals.npy", lambda a: -a), "normals", "faces away"),
    "normals in the world's axes": (turn_into_world, "normals", r"0/normals.npy\[0, "),
    "normals of Blender's camera": (
        change("0/normals.npy", lambda a: a * np.array([1, -1, 1], "f4")), "normals", "not normal to the plane"
    ),
    "normals one frame late": (
        change("0/normals.npy", lambda a: np.roll(a, 1, axis=0)), "normals", "not normal to the plane"
    ),
    "normals of no length": (change("1/normals.npy", lambda a: a * np.float32(0.99)), "normals", "must have length 1"),
    "normals missing": (assign("1/normals.npy", (2, slice(0, 30)), 0), "normals", "has no normal"),
    "normals in 16 bits": (change("1/normals.npy", lambda a: a.astype("f2")), "layout", "must be float32"),
    "flow the other way": (other_way("0/flow.npy"), "flow", "is not where depth and cameras take"),
    "flow half a pixel off": (change("0/flow.npy", lambda a: a + np.float32(0.5)), "flow", "is not where depth"),
    "flow y before x": (
        change("1/flow.npy", lambda a: np.ascontiguousarray(a[..., ::-1])), "flow of tracks", "its own way in the image"
    ),
    "flow one frame late": (change("1/flow.npy", lambda a: np.roll(a, 1, axis=0)), "flow", "is not where depth"),
    "flow for one frame too many": (change("1/flow.npy", lambda a: a[[0, 1, 2, 3, 4, 4]]), "layout", "flow.npy must"),
    "flow of what nothing shows": (assign("2/flow_state.npy", (1, slice(0, 20)), 0), "flow", "state 0"),
    "all flow called seen": (
        change("2/flow_state.npy", lambda a: np.minimum(a, 1)), "flow", "state that does not fit"
    ),
    "hidden flow called seen": (
        change("0/flow_to_1_state.npy", lambda a: np.where(a == 2, 1, a).astype("u1")),
        "view flow against depth",
        "is called seen",
    ),
    "seen flow called hidden": (
        change("0/flow_to_1_state.npy", lambda a: np.where(a == 1, 2, a).astype("u1")),
        "view flow against depth",
        "is called hidden",
    ),
    "flow to the wrong view": (swap("0/flow_to_1.npy", "0/flow_to_2.npy"), "view flow", r"0/flow_to_1.npy\[0, "),
    "flow to views the other way": (other_way("2/flow_to_0.npy"), "view flow", "is not where depth and cameras"),
    "no scene flow": (change("0/scene_flow.npy", np.zeros_like), "scene flow of tracks", "another scene flow"),
    "scene flow in millimetres": (
        change("0/scene_flow.npy", lambda a: a * np.float32(1000)), "scene flow of tracks", "another scene flow"
    ),
    "scene flow the other way": (other_way("1/scene_flow.npy"), "flow", "is not where depth and cameras take"),
    "walls that flow": (
        assign("1/scene_flow.npy", (3, slice(0, 3)), 1e-6), "scene flow", "foreground_mask.npy shows no actor"
    ),
    "surfaces of other tracks": (
        change("surface_xyz.npy", lambda a: np.roll(a, 1, axis=1)),
        "on surface",
        "from its triangle",
    ),
}  # fmt: skip
