"""What Kimodo is asked, and what it answers: prompts, a constraints file, and .npz files.

Source: https://github.com/nv-tlabs/kimodo (docs: user_guide/cli, user_guide/constraints, user_guide/output_formats,
key_concepts/limitations). Kimodo is Y up and faces +Z, in metres, at 30 frames per second; identity rotations are
its T-pose; a heading of 0 faces +Z and grows towards +X, which is our heading in our axes.
"""

import json
import re
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import Float64
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.amass import read_amass
from perpetua.motion.recorded.archive import read_arrays
from perpetua.motion.recorded.clip import OURS_FROM_Y_UP, Clip, check_clip
from perpetua.motion.recorded.skeleton_names import KIMODO_JOINTS
from perpetua.scene.actor import BODY_JOINTS

KIMODO_FPS = 30.0
# One prompt makes at most 10 s; fewer frames than a second make no motion worth a prompt of its own.
_MOST_FRAMES, _FEWEST_FRAMES = 299, 30
TRANSITION_FRAMES = 5
# What is made before the first and after the last frame, so that both fall amid a stride.
LEAD_S = 0.5
_G1_JOINTS = 34
SUPPORTED = "its SOMA models (Kimodo-SOMA-RP-v1, Kimodo-SOMA-SEED-v1) and Kimodo-SMPLX-RP-v1 are supported"


@dataclass(frozen=True)
class KimodoRequest:
    """A sequence to be made: sentences, how many frames each lasts, and where the body is at each frame.

    ``place_m`` and ``heading_rad`` are ours; ``local_m`` and ``turn_rad`` the same from the first frame: forward and
    left of where it is, turned from how it faces.
    """

    prompts: tuple[str, ...]
    frames: tuple[int, ...]
    place_m: Float64[np.ndarray, "K 3"]
    heading_rad: Float64[np.ndarray, " K"]

    @property
    def local_m(self) -> Float64[np.ndarray, "K 2"]:
        """Path on the floor from the first frame, which is at the origin facing +X."""
        away_m = self.place_m[:, :2] - self.place_m[0, :2]
        cosine, sine = np.cos(self.heading_rad[0]), np.sin(self.heading_rad[0])
        return np.stack([cosine * away_m[:, 0] + sine * away_m[:, 1], cosine * away_m[:, 1] - sine * away_m[:, 0]], 1)

    @property
    def turn_rad(self) -> Float64[np.ndarray, " K"]:
        """Heading from the first frame's."""
        return np.asarray(self.heading_rad - self.heading_rad[0])

    @property
    def prompt(self) -> str:
        """The prompts as one argument: Kimodo splits at full stops."""
        return " ".join(f"{prompt}." for prompt in self.prompts)

    @property
    def durations(self) -> str:
        """Durations in seconds as one argument; half a frame more, as Kimodo rounds down."""
        return " ".join(f"{(frames + 0.5) / KIMODO_FPS:.6f}" for frames in self.frames)

    def constraints(self) -> str:
        """The constraints file: one dense path on the floor with headings."""
        path = {
            "type": "root2d",
            "frame_indices": list(range(len(self.heading_rad))),
            "smooth_root_2d": np.round(self.local_m[:, ::-1], 5).tolist(),
            "global_root_heading": np.round(np.stack([np.cos(self.turn_rad), np.sin(self.turn_rad)], 1), 6).tolist(),
        }
        return json.dumps([path])


def make_request(description: str, path: RoutePath) -> KimodoRequest:
    """What to ask for so that a body does what is described along a route."""
    total = max(_FEWEST_FRAMES, int(np.ceil((path.end_s + 2.0 * LEAD_S) * KIMODO_FPS)) + 1)
    sentences = _sentences(description)[: total // _FEWEST_FRAMES]
    prompts: list[str] = []
    frames: list[int] = []
    for sentence, count in zip(sentences, _split_evenly(total, len(sentences)), strict=True):
        pieces = _split_evenly(count, int(np.ceil(count / _MOST_FRAMES)))
        prompts += [sentence] * len(pieces)
        frames += pieces
    time_s = np.arange(total) / KIMODO_FPS - LEAD_S
    return KimodoRequest(tuple(prompts), tuple(frames), path.position_m(time_s), path.heading_rad(time_s))


def _sentences(description: str) -> list[str]:
    """Sentences about a person: "walks. waves" -> ["A person walks", "A person waves"]."""
    # A stop inside a number ends no sentence, but Kimodo would take it for one.
    text = re.sub(r"(?<=\d)\.(?=\d)", ",", " ".join(description.split()))
    sentences = [sentence.strip() for sentence in text.split(".") if sentence.strip()] or ["walks"]
    return [_about_a_person(sentence) for sentence in sentences]


def _about_a_person(sentence: str) -> str:
    if re.match(r"(?i)(a|an|the|one|someone|somebody|he|she|they)\b", sentence):
        return sentence[0].upper() + sentence[1:]
    return f"A person {sentence[0].lower()}{sentence[1:]}"


def _split_evenly(total: int, count: int) -> list[int]:
    edges = [round(total * index / count) for index in range(count + 1)]
    return [end - start for start, end in pairwise(edges)]


def read_result(folder: Path, stem: str, request: KimodoRequest) -> Clip:
    """What Kimodo wrote, put back to where the route is: ``<stem>.npz``, else ``<stem>_amass.npz``.

    Raises:
        AssetError: no file, keys or shapes that do not fit, a skeleton that is not supported, numbers not finite.
    """
    own, amass = folder / f"{stem}.npz", folder / f"{stem}_amass.npz"
    if own.exists():
        return read_kimodo(own, request)
    if not amass.exists():
        raise AssetError(f"Kimodo finished and wrote neither '{own.name}' nor '{amass.name}': is it version 1?")
    clip = read_amass(amass, "z")
    # The export faces +Y, and what it calls the root is off the pelvis by a constant: it begins where it was asked to.
    turned = Rotation.from_euler("z", -90.0, degrees=True).as_matrix()
    pelvis_m = clip.pelvis @ turned.T
    pelvis_m[:, :2] -= pelvis_m[0, :2]
    _check_frames(len(pelvis_m), amass, request)
    return _placed(replace(clip, world_from_joint=turned @ clip.world_from_joint, pelvis=pelvis_m), request)


def read_kimodo(path: Path, request: KimodoRequest) -> Clip:
    """Kimodo's own .npz file, put back to where the route is.

    Raises:
        AssetError: see ``read_result``.
    """
    arrays = read_arrays(path, ("posed_joints", "global_rot_mats", "foot_contacts"))
    missing = {"posed_joints", "global_rot_mats", "foot_contacts"} - set(arrays)
    if missing:
        raise AssetError(f"'{path}' lacks {sorted(missing)}: files of Kimodo 1 hold them; check the program's version")
    place, rotation = arrays["posed_joints"].astype(np.float64), arrays["global_rot_mats"].astype(np.float64)
    joints = _joints(place, rotation, arrays["foot_contacts"], path)
    _check_frames(len(place), path, request)
    contacts = arrays["foot_contacts"].astype(np.float64) > 0.5
    place, rotation = place[:, joints], rotation[:, joints]
    for name, values in (("posed_joints", place), ("global_rot_mats", rotation)):
        if not np.isfinite(values).all():
            raise AssetError(f"'{path}' holds {name} that are not finite numbers")
    if np.abs(rotation @ np.swapaxes(rotation, 2, 3) - np.eye(3)).max() > 1e-2 or np.linalg.det(rotation).min() < 0.5:
        raise AssetError(f"'{path}' holds global_rot_mats that are no rotations")
    rotation = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_matrix().reshape(rotation.shape)
    ours = Clip(
        path.name,
        KIMODO_FPS,
        OURS_FROM_Y_UP @ rotation @ OURS_FROM_Y_UP.T,
        place[:, 0] @ OURS_FROM_Y_UP.T,
        _leg_m(place),
        np.stack([contacts[:, :2].any(axis=1), contacts[:, 2:].any(axis=1)], axis=1),
    )
    return _placed(ours, request)


def _joints(place: np.ndarray, rotation: np.ndarray, contacts: np.ndarray, path: Path) -> list[int]:
    """Which of the file's joints are ours."""
    count = place.shape[1] if place.ndim == 3 else -1
    if place.shape != (len(place), count, 3) or rotation.shape != (*place.shape, 3):
        raise AssetError(
            f"'{path}' has posed_joints {place.shape} and global_rot_mats {rotation.shape}; (T, J, 3) and "
            "(T, J, 3, 3) are needed"
        )
    if contacts.shape != (len(place), 4):
        raise AssetError(f"'{path}' has foot_contacts {contacts.shape}; ({len(place)}, 4) is needed")
    if count == _G1_JOINTS:
        raise AssetError(f"'{path}' holds Kimodo's G1 robot, whose joints are not a person's; {SUPPORTED}")
    if count not in KIMODO_JOINTS:
        raise AssetError(f"'{path}' holds {count} joints; Kimodo's bodies have {sorted(KIMODO_JOINTS)}; {SUPPORTED}")
    return list(KIMODO_JOINTS[count])


def _leg_m(place: Float64[np.ndarray, "T 22 3"]) -> float:
    hip, knee, ankle = (place[:, BODY_JOINTS.index(f"left_{name}")] for name in ("hip", "knee", "ankle"))
    length_m = np.linalg.norm(knee - hip, axis=1) + np.linalg.norm(ankle - knee, axis=1)
    return float(np.median(length_m))


def _check_frames(frames: int, path: Path, request: KimodoRequest) -> None:
    wanted = sum(request.frames)
    if abs(frames - wanted) > 2:
        raise AssetError(f"'{path}' has {frames} frames; {wanted} were asked for")


def _placed(clip: Clip, request: KimodoRequest) -> Clip:
    """A clip that begins at the origin facing +X, moved to the route's beginning."""
    turn = Rotation.from_euler("z", float(request.heading_rad[0])).as_matrix()
    moved = replace(clip, world_from_joint=turn @ clip.world_from_joint, pelvis=clip.pelvis @ turn.T)
    moved.pelvis[:, :2] += request.place_m[0, :2]
    return check_clip(moved)
