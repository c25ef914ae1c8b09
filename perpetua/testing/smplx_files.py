"""A synthetic SMPL-X model file: the true shapes, keys and tree, a jointed figure of tubes instead of a person."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

SIDES = ((1.0, "left"), (-1.0, "right"))
_CENTRE = {
    0: (0.0, 0.0, 0.95), 3: (0.0, 0.0, 1.06), 6: (0.0, 0.0, 1.19), 9: (0.0, 0.0, 1.26),
    12: (-0.01, 0.0, 1.45), 15: (0.01, 0.0, 1.53), 22: (0.02, 0.0, 1.55),
}  # fmt: skip
_LEFT = {
    1: (0.0, 0.09, 0.88), 4: (0.01, 0.10, 0.48), 7: (-0.02, 0.10, 0.08), 10: (0.11, 0.11, 0.03),
    13: (0.0, 0.07, 1.40), 16: (0.0, 0.17, 1.42), 18: (0.0, 0.43, 1.42), 20: (0.0, 0.68, 1.42), 23: (0.08, 0.03, 1.60),
}  # fmt: skip
_FINGER_X_M = (0.025, 0.008, -0.025, -0.008, 0.045)
_PARENTS = [-1, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 15, 15, 15]


def joints_m() -> np.ndarray:
    """The 55 joints, facing +X, Z up."""
    joint_m = np.zeros((55, 3))
    for joint, place in _CENTRE.items():
        joint_m[joint] = place
    for joint, (x, y, z) in _LEFT.items():
        joint_m[joint], joint_m[joint + 1] = (x, y, z), (x, -y, z)
    for sign, first in ((1.0, 25), (-1.0, 40)):
        for finger, x in enumerate(_FINGER_X_M):
            for segment in range(3):
                joint_m[first + 3 * finger + segment] = (x, sign * (0.76 + 0.03 * segment), 1.42)
    return joint_m


def parents() -> list[int]:
    fingers = []
    for wrist, first in ((20, 25), (21, 40)):
        for finger in range(5):
            fingers += [wrist, first + 3 * finger, first + 3 * finger + 1]
    return [*_PARENTS, *fingers]


@dataclass(frozen=True)
class _Tube:
    """Rings from ``start`` to ``end``; ``radii`` across it, along its share from 0 to 1."""

    start: tuple[float, float, float]
    end: tuple[float, float, float]
    axes: tuple[int, int]
    radii: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    rings: int
    segments: int
    owner: Callable[[np.ndarray], np.ndarray]


def _flat(first: float, second: float) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """An ellipse that closes at both ends."""

    def radii(fraction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        round_off = np.minimum(np.sqrt(np.clip(np.minimum(fraction, 1.0 - fraction) * 12.0, 0.0, 1.0)) + 0.02, 1.0)
        return first * round_off, second * round_off

    return radii


def _by(axis: int, limits: tuple[float, ...], joints: tuple[int, ...]) -> Callable[[np.ndarray], np.ndarray]:
    """The joint of each place by its coordinate, whose limits rise."""
    return lambda place: np.array(joints)[np.searchsorted(np.array(limits), np.abs(place[:, axis]))]


def _arm_owner(sign: float) -> Callable[[np.ndarray], np.ndarray]:
    shoulder, elbow, wrist, first = (16, 18, 20, 25) if sign > 0 else (17, 19, 21, 40)

    def owner(place: np.ndarray) -> np.ndarray:
        joint = _by(1, (0.43, 0.68), (shoulder, elbow, wrist))(place)
        finger = np.argmin(np.abs(place[:, :1] - np.array(_FINGER_X_M)), axis=1)
        segment = np.clip(((np.abs(place[:, 1]) - 0.76) // 0.03).astype(int), 0, 2)
        return np.where(np.abs(place[:, 1]) > 0.76, first + 3 * finger + segment, joint)

    return owner


def _tubes() -> list[_Tube]:
    tubes = [
        _Tube(
            (0.0, 0.0, 0.84),
            (0.0, 0.0, 1.48),
            (0, 1),
            _flat(0.10, 0.15),
            60,
            29,
            _by(2, (1.0, 1.12, 1.22), (0, 3, 6, 9)),
        ),
        _Tube((0.01, 0.0, 1.42), (0.01, 0.0, 1.74), (0, 1), _flat(0.09, 0.075), 43, 29, _by(2, (1.5,), (12, 15))),
    ]
    for sign, _ in SIDES:
        leg, foot = ((1, 4, 7), (7, 10)) if sign > 0 else ((2, 5, 8), (8, 11))
        hip, ankle, y = (0.0, sign * 0.09, 0.93), (-0.01, sign * 0.10, 0.05), sign * 0.11
        tubes += [
            _Tube(
                (0.0, sign * 0.12, 1.42), (0.0, sign * 0.87, 1.42), (0, 2), _flat(0.045, 0.04), 55, 29, _arm_owner(sign)
            ),
            _Tube(ankle, hip, (0, 1), _flat(0.065, 0.06), 35, 29, _by(2, (0.09, 0.48), leg[::-1])),
            _Tube((-0.09, y, 0.04), (0.18, y, 0.04), (1, 2), _flat(0.045, 0.04), 20, 29, _forward(0.11, foot)),
            _Tube((0.07, sign * 0.03, 1.60), (0.094, sign * 0.03, 1.60), (1, 2), _ball(0.012), 34, 16, _eye(sign)),
        ]
    return tubes


def _forward(limit: float, joints: tuple[int, int]) -> Callable[[np.ndarray], np.ndarray]:
    return lambda place: np.where(place[:, 0] > limit, joints[1], joints[0])


def _eye(sign: float) -> Callable[[np.ndarray], np.ndarray]:
    return lambda place: np.full(len(place), 23 if sign > 0 else 24)


def _ball(radius: float) -> Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]:
    def radii(fraction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        size = radius * np.sqrt(np.clip(4.0 * fraction * (1.0 - fraction), 0.001, 1.0))
        return size, size

    return radii


def _mesh(tube: _Tube) -> tuple[np.ndarray, np.ndarray]:
    fraction = (np.arange(tube.rings) + 0.5) / tube.rings
    start, end = np.array(tube.start, dtype=float), np.array(tube.end, dtype=float)
    angle = 2.0 * np.pi * np.arange(tube.segments) / tube.segments
    places = np.repeat((start + fraction[:, None] * (end - start))[:, None], tube.segments, axis=1)
    for axis, radius, wave in zip(tube.axes, tube.radii(fraction), (np.cos(angle), np.sin(angle)), strict=True):
        places[:, :, axis] += radius[:, None] * wave
    ring = np.arange(tube.segments)
    faces = []
    for index in range(tube.rings - 1):
        a, b = index * tube.segments + ring, index * tube.segments + np.roll(ring, -1)
        c, d = b + tube.segments, a + tube.segments
        faces += [np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)]
    count = tube.rings * tube.segments
    last = count - tube.segments
    faces.append(np.stack([np.roll(ring, -1), ring, np.full_like(ring, count)], axis=1))
    faces.append(np.stack([last + ring, last + np.roll(ring, -1), np.full_like(ring, count + 1)], axis=1))
    return np.concatenate([places.reshape(-1, 3), [start, end]]), np.concatenate(faces)


def figure() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices facing +X, faces and owning joints: 10,475 vertices and 20,908 faces."""
    vertices, faces, owners, offset = [], [], [], 0
    for tube in _tubes():
        places, triangles = _mesh(tube)
        # Outward whichever way the tube runs.
        corners = places[triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        middle = 0.5 * (np.array(tube.start) + np.array(tube.end))
        if np.sum(normal * (corners.mean(axis=1) - middle)) < 0:
            triangles = triangles[:, ::-1]
        vertices.append(places)
        faces.append(triangles + offset)
        owners.append(tube.owner(places))
        offset += len(places)
    return np.concatenate(vertices), np.concatenate(faces)[:-2], np.concatenate(owners)


def _regressor(vertices_m: np.ndarray) -> np.ndarray:
    rows = np.zeros((55, len(vertices_m)))
    for joint, place in enumerate(joints_m()):
        near = np.argsort(np.linalg.norm(vertices_m - place, axis=1), kind="stable")[:120]
        equations = np.concatenate([vertices_m[near].T, np.ones((1, len(near)))])
        rows[joint, near] = np.linalg.lstsq(equations, np.append(place, 1.0), rcond=None)[0]
    return rows


def model_arrays(directions: int, size: float = 1.0) -> dict[str, np.ndarray]:
    """All arrays of a model file with so many shape directions, of a figure ``size`` times as large."""
    ours_m, faces, owner = figure()
    vertices_m = size * ours_m[:, [1, 2, 0]]
    rng = np.random.default_rng(0)
    shapes = np.zeros((len(vertices_m), 3, directions), dtype=np.float32)
    shapes[:, :, 0] = 0.03 * vertices_m
    shapes[:, ::2, 1] = 0.02 * vertices_m[:, ::2]
    shapes[:, 1, 2:10] = 0.004 * np.sin(4.0 * vertices_m[:, :1] + np.arange(8)) * vertices_m[:, 1:2]
    poses = np.zeros((len(vertices_m), 3, 486), dtype=np.float32)
    poses[::50, :, 100:160] = rng.normal(0.0, 0.002, (len(vertices_m[::50]), 3, 60))
    weights = np.zeros((len(vertices_m), 55))
    weights[np.arange(len(vertices_m)), owner] = 1.0
    tree = np.stack([np.array(parents()), np.arange(55)]).astype(np.int64)
    return {
        "v_template": vertices_m,
        "f": faces.astype(np.uint32),
        "shapedirs": shapes,
        "posedirs": poses,
        "J_regressor": _regressor(ours_m),
        "weights": weights,
        "kintree_table": tree,
        "hands_componentsl": np.eye(45),
        "hands_componentsr": np.eye(45),
        "hands_meanl": np.zeros(45),
        "hands_meanr": np.zeros(45),
        "lmk_faces_idx": np.arange(51),
        "lmk_bary_coords": np.full((51, 3), 1.0 / 3.0),
        "vt": (0.5 + 0.4 * ours_m[:, 1:]).clip(0.0, 1.0),
        "ft": faces.astype(np.uint32),
    }


def write_model(path: Path, directions: int = 20, size: float = 1.0, **changed: np.ndarray | None) -> Path:
    """Writes a model file; ``changed`` replaces arrays, or leaves them out where None."""
    arrays = {**model_arrays(directions, size), **changed}
    path.parent.mkdir(parents=True, exist_ok=True)
    kept = {name: array for name, array in arrays.items() if array is not None}
    np.savez_compressed(path, **kept)
    return path
