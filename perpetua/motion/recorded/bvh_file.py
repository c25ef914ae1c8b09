"""BVH text: a hierarchy of joints with offsets and channels, then one line of channel values per frame.

Source: the format's description by M. Meredith and S. Maddock, "Motion Capture File Formats Explained" (2001).
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.recorded.clip import check_frames

_MOST_BYTES = 64 * 2**20
_MOST_JOINTS = 1000
_CHANNELS = ("xposition", "yposition", "zposition", "xrotation", "yrotation", "zrotation")


@dataclass(frozen=True)
class BvhJoint:
    """One joint: its parent's index (-1 for the root), its offset from it, its channels in order."""

    name: str
    parent: int
    offset: tuple[float, float, float]
    channels: tuple[str, ...]


@dataclass(frozen=True)
class BvhMotion:
    """Joints, and their global rotations and positions in the file's unit and axes."""

    joints: tuple[BvhJoint, ...]
    fps: float
    rotation: Float64[np.ndarray, "T J 3 3"]
    position: Float64[np.ndarray, "T J 3"]

    @property
    def rest_position(self) -> Float64[np.ndarray, "J 3"]:
        """Joints with every rotation zero, the root at the origin."""
        place = np.zeros((len(self.joints), 3))
        for index, joint in enumerate(self.joints):
            if joint.parent >= 0:
                place[index] = place[joint.parent] + joint.offset
        return place


def read_bvh(path: Path) -> BvhMotion:
    """Reads and poses a BVH file.

    Raises:
        AssetError: the file cannot be read, is too large, or does not follow the format; names the line's word.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise AssetError(f"'{path}' is larger than {_MOST_BYTES} bytes")
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise AssetError(f"cannot read '{path}': {error}") from None
    head, separator, tail = text.partition("MOTION")
    if not separator:
        raise AssetError(f"'{path}' is not a BVH file: it has no MOTION section")
    joints = _Hierarchy(head.split(), path).read()
    values, fps = _read_frames(tail, sum(len(joint.channels) for joint in joints), path)
    rotation, position = _pose(joints, values)
    return BvhMotion(joints, fps, rotation, position)


class _Hierarchy:
    """Walks the words of the HIERARCHY section."""

    def __init__(self, words: list[str], path: Path) -> None:
        self._words = words
        self._path = path
        self._at = 0

    def read(self) -> tuple[BvhJoint, ...]:
        self._expect("HIERARCHY")
        joints: list[BvhJoint] = []
        parents: list[int] = [-1]
        self._at_word("ROOT")
        while len(parents) > 1 or not joints:
            word = self._next()
            if word in ("ROOT", "JOINT"):
                name = self._name()
                joints.append(self._joint(name, parents[-1]))
                parents.append(len(joints) - 1)
            elif word == "End":
                self._skip_end_site()
            elif word == "}":
                parents.pop()
            else:
                raise self._wrong(f"'{word}'", "JOINT, End Site or }")
            if len(joints) > _MOST_JOINTS:
                raise AssetError(f"'{self._path}' has more than {_MOST_JOINTS} joints")
        return tuple(joints)

    def _joint(self, name: str, parent: int) -> BvhJoint:
        self._expect("OFFSET")
        offset = (self._number(), self._number(), self._number())
        channels: tuple[str, ...] = ()
        if self._peek() == "CHANNELS":
            self._next()
            channels = tuple(self._next().lower() for _ in range(int(self._number())))
            if not set(channels) <= set(_CHANNELS):
                raise self._wrong(f"channels {list(channels)}", f"channels among {list(_CHANNELS)}")
        return BvhJoint(name, parent, offset, channels)

    def _name(self) -> str:
        words = [self._next()]
        while words[-1] != "{":
            words.append(self._next())
        return "_".join(words[:-1])

    def _skip_end_site(self) -> None:
        while self._next() != "}":
            pass

    def _peek(self) -> str:
        return self._words[self._at] if self._at < len(self._words) else ""

    def _next(self) -> str:
        if self._at >= len(self._words):
            raise self._wrong("the end of the hierarchy", "a closing bracket")
        self._at += 1
        return self._words[self._at - 1]

    def _at_word(self, word: str) -> None:
        if self._peek() != word:
            raise self._wrong(f"'{self._peek()}'", word)

    def _expect(self, word: str) -> None:
        self._at_word(word)
        self._next()

    def _number(self) -> float:
        word = self._next()
        try:
            value = float(word)
        except ValueError:
            raise self._wrong(f"'{word}'", "a number") from None
        if not np.isfinite(value):
            raise self._wrong(f"'{word}'", "a finite number")
        return value

    def _wrong(self, found: str, wanted: str) -> AssetError:
        return AssetError(f"'{self._path}' is not a valid BVH file: {found} stands where {wanted} is expected")


def _read_frames(tail: str, width: int, path: Path) -> tuple[Float64[np.ndarray, "T K"], float]:
    words = tail.split()
    try:
        if words[0] != "Frames:" or words[2:4] != ["Frame", "Time:"]:
            raise ValueError("MOTION must begin with 'Frames: N' and 'Frame Time: S'")
        frames, frame_s = int(words[1]), float(words[4])
        check_frames(path.name, frames)
        if not (frame_s > 0.0 and np.isfinite(frame_s)):
            raise ValueError(f"a frame time of {frame_s} s")
        if len(words) - 5 != frames * width:
            raise ValueError(f"{frames} frames of {width} channels need {frames * width} numbers, not {len(words) - 5}")
        values = np.array(words[5:], dtype=np.float64).reshape(frames, width)
    except (ValueError, IndexError) as error:
        raise AssetError(f"'{path}' is not a valid BVH file: {error}") from None
    if not np.isfinite(values).all():
        raise AssetError(f"'{path}' holds channel values that are not finite numbers: repair the file")
    return values, 1.0 / frame_s


def _pose(
    joints: tuple[BvhJoint, ...], values: Float64[np.ndarray, "T K"]
) -> tuple[Float64[np.ndarray, "T J 3 3"], Float64[np.ndarray, "T J 3"]]:
    rotation = np.tile(np.eye(3), (len(values), len(joints), 1, 1))
    position = np.zeros((len(values), len(joints), 3))
    column = 0
    for index, joint in enumerate(joints):
        columns = values[:, column : column + len(joint.channels)]
        column += len(joint.channels)
        local = _local_rotation(joint, columns)
        if joint.parent < 0:
            rotation[:, index], position[:, index] = local, _root_position(joint, columns)
        else:
            above = rotation[:, joint.parent]
            rotation[:, index] = above @ local
            position[:, index] = position[:, joint.parent] + above @ np.array(joint.offset)
    return rotation, position


def _local_rotation(joint: BvhJoint, columns: Float64[np.ndarray, "T K"]) -> Float64[np.ndarray, "T 3 3"]:
    turns = [index for index, channel in enumerate(joint.channels) if channel.endswith("rotation")]
    if not turns:
        return np.tile(np.eye(3), (len(columns), 1, 1))
    # Channels are applied from the parent outwards, each about an axis that the ones before have turned.
    axes = "".join(joint.channels[index][0].upper() for index in turns)
    return np.asarray(_euler(axes, columns[:, turns]))


def _euler(axes: str, angle_deg: Float64[np.ndarray, "T K"]) -> Float64[np.ndarray, "T 3 3"]:
    rotation = np.eye(3)
    for column, axis in enumerate(axes):
        rotation = rotation @ Rotation.from_euler(axis, angle_deg[:, [column]], degrees=True).as_matrix()
    return np.asarray(rotation)


def _root_position(joint: BvhJoint, columns: Float64[np.ndarray, "T K"]) -> Float64[np.ndarray, "T 3"]:
    place = np.tile(np.array(joint.offset), (len(columns), 1))
    for index, channel in enumerate(joint.channels):
        if channel.endswith("position"):
            place[:, "xyz".index(channel[0])] = columns[:, index]
    return place
