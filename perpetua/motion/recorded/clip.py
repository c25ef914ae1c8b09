"""A recorded motion in our own convention, whatever file it came from."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.rotations import blend
from perpetua.scene.actor import BODY_JOINTS

# Body models, BVH files and Kimodo are Y up and face +Z at rest; we are Z up and face +X: (x, y, z) -> (z, x, y).
OURS_FROM_Y_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
FEWEST_FRAMES = 8
MOST_FRAMES = 100_000


@dataclass(frozen=True)
class Clip:
    """A recorded motion, Z up.

    ``world_from_joint`` are global rotations of ``BODY_JOINTS`` from our rest pose; ``pelvis_m`` is the pelvis in the
    recorded body's own unit of length; ``leg`` the length of its thigh and shin in that unit (None if unknown).
    ``standing`` flags the left and the right foot on the floor, where the file says so.
    """

    name: str
    fps: float
    world_from_joint: Float64[np.ndarray, "T 22 3 3"]
    pelvis: Float64[np.ndarray, "T 3"]
    leg: float | None
    standing: Bool[np.ndarray, "T 2"] | None = None
    finger_from_parent: Float64[np.ndarray, "T 30 3 3"] | None = None

    @property
    def seconds(self) -> float:
        """Time from the first to the last frame."""
        return (len(self.pelvis) - 1) / self.fps


def check_frames(name: str, frames: int) -> None:
    """Raises AssetError where a recording is too short or too long to be used."""
    if not FEWEST_FRAMES <= frames <= MOST_FRAMES:
        raise AssetError(f"'{name}' has {frames} frames; {FEWEST_FRAMES} to {MOST_FRAMES} can be used")


def check_clip(clip: Clip) -> Clip:
    """The clip itself.

    Raises:
        AssetError: too few or too many frames, no usable frame rate, a number that is not finite.
    """
    frames = len(clip.pelvis)
    check_frames(clip.name, frames)
    if not (np.isfinite(clip.fps) and 1.0 <= clip.fps <= 1000.0):
        raise AssetError(f"'{clip.name}' has {clip.fps:g} frames per second; 1 to 1000 can be used")
    for name, values in (("rotations", clip.world_from_joint), ("root positions", clip.pelvis)):
        if not np.isfinite(values).all():
            frame = int(np.argmin(np.isfinite(values.reshape(frames, -1)).all(axis=1)))
            raise AssetError(f"'{clip.name}' holds {name} that are not finite numbers (frame {frame}): repair the file")
    if clip.leg is not None and not clip.leg > 0.0:
        raise AssetError(f"'{clip.name}' has legs without length: it cannot be scaled to a body")
    return clip


def resample_rotations(
    rotation: Float64[np.ndarray, "T J 3 3"], row: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N J 3 3"]:
    """Rotations at fractional frames.

    Neighbours differ by a few degrees, for which the straight line between two matrices, made orthonormal again, is
    as good as the shortest turn and ten times as quick.
    """
    last = len(rotation) - 1
    low = np.clip(np.floor(row).astype(int), 0, max(last - 1, 0))
    weight = np.clip(row - low, 0.0, 1.0)[:, None, None, None]
    mixed = (1.0 - weight) * rotation[low] + weight * rotation[np.minimum(low + 1, last)]
    first, second = mixed[..., 0], mixed[..., 1]
    first = first / np.linalg.norm(first, axis=-1, keepdims=True)
    second = second - np.sum(first * second, axis=-1, keepdims=True) * first
    second = second / np.linalg.norm(second, axis=-1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=-1)


def mix_rotations(
    start: Float64[np.ndarray, "N J 3 3"], end: Float64[np.ndarray, "N J 3 3"], weight: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, "N J 3 3"]:
    """Each row a fraction of its own (0 to 1) of the way from ``start`` to ``end``."""
    shape = start.shape
    turn = Rotation.from_matrix((np.swapaxes(start, -1, -2) @ end).reshape(-1, 3, 3)).as_rotvec()
    part = Rotation.from_rotvec(turn * np.repeat(weight, shape[1])[:, None]).as_matrix().reshape(shape)
    return np.asarray(start @ part)


def resample_rows(values: Float64[np.ndarray, "T K"], row: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N K"]:
    """Values at fractional frames, linear between neighbours."""
    frames = np.arange(len(values), dtype=np.float64)
    return np.stack([np.interp(row, frames, column) for column in values.T], axis=1)


def fill_missing(rotations: dict[str, Float64[np.ndarray, "T 3 3"]]) -> Float64[np.ndarray, "T 22 3 3"]:
    """All body joints from those that a recording has.

    A missing spine joint turns half-way between its neighbours; any other turns with its parent.
    """
    known = dict(rotations)
    known.setdefault("spine3", known["pelvis"])
    known.setdefault("spine1", blend(known["pelvis"], known["spine3"], 0.33))
    known.setdefault("spine2", blend(known["spine1"], known["spine3"], 0.5))
    known.setdefault("neck", blend(known["spine3"], known["head"], 0.5))
    for side in ("left", "right"):
        known.setdefault(f"{side}_collar", known["spine3"])
        known.setdefault(f"{side}_wrist", known[f"{side}_elbow"])
        known.setdefault(f"{side}_foot", known[f"{side}_ankle"])
    return np.stack([known[name] for name in BODY_JOINTS], axis=1)


def is_y_up(up: Float64[np.ndarray, "T 3"]) -> bool:
    """Whether a body whose own up direction is ``up`` stands along Y (else along Z) most of the time."""
    middle = np.median(up, axis=0)
    return bool(abs(middle[1]) > abs(middle[2]))
