"""Which joint of a recorded skeleton is which of ours.

Sources of the names: SMPL-X (https://github.com/vchoutas/smplx); Mixamo's and LaFAN1's BVH files
(https://github.com/ubisoft/ubisoft-laforge-animation-dataset); CMU's as converted at https://sites.google.com/a/cgspeed.com;
SOMA and its order in Kimodo's files (https://github.com/nv-tlabs/kimodo, skeleton definitions).
"""

from dataclasses import dataclass

from perpetua.scene.actor import BODY_JOINTS

REQUIRED = (
    "pelvis", "left_hip", "right_hip", "left_knee", "right_knee", "left_ankle", "right_ankle", "head",
    "left_shoulder", "right_shoulder", "left_elbow", "right_elbow",
)  # fmt: skip


@dataclass(frozen=True)
class Naming:
    """A family of skeletons: our joint -> its name there, lower case without separators; ``left`` stands for a side."""

    name: str
    joints: dict[str, str]


def _both_sides(joints: dict[str, str]) -> dict[str, str]:
    right = {
        key.replace("left", "right"): value.replace("left", "right") for key, value in joints.items() if "left" in key
    }
    return joints | right


_LIMBS = {
    "left_hip": "leftupleg", "left_knee": "leftleg", "left_ankle": "leftfoot", "left_foot": "lefttoebase",
    "left_collar": "leftshoulder", "left_shoulder": "leftarm", "left_elbow": "leftforearm", "left_wrist": "lefthand",
}  # fmt: skip
_TRUNK = {"pelvis": "hips", "spine1": "spine", "spine2": "spine1", "spine3": "spine2", "neck": "neck", "head": "head"}

NAMINGS = (
    Naming("SMPL-X", {name: name.replace("_", "") for name in BODY_JOINTS}),
    Naming(
        "SOMA",
        _both_sides(
            _TRUNK
            | _LIMBS
            | {"spine1": "spine1", "spine2": "spine2", "spine3": "chest", "neck": "neck1"}
            | {"left_hip": "leftleg", "left_knee": "leftshin"}
        ),
    ),
    Naming("CMU", _both_sides(_TRUNK | _LIMBS | {"spine1": "lowerback", "spine2": "spine", "spine3": "spine1"})),
    Naming("Mixamo", _both_sides(_TRUNK | _LIMBS)),
    Naming("LaFAN1", _both_sides(_TRUNK | _LIMBS | {"left_foot": "lefttoe"})),
    Naming(
        "Biovision",
        _both_sides(
            _TRUNK
            | {"spine1": "chest", "spine2": "chest2", "spine3": "chest3", "left_collar": "leftcollar"}
            | {"left_hip": "lefthip", "left_knee": "leftknee", "left_ankle": "leftankle", "left_foot": "lefttoe"}
            | {"left_shoulder": "leftshoulder", "left_elbow": "leftelbow", "left_wrist": "leftwrist"}
        ),
    ),
)

# Kimodo's joints that we use -> their places in its arrays of 77 and of 30 joints.
_SOMA_77 = {
    "pelvis": 0, "spine1": 1, "spine2": 2, "spine3": 3, "neck": 4, "head": 6,
    "left_collar": 11, "left_shoulder": 12, "left_elbow": 13, "left_wrist": 14,
    "right_collar": 39, "right_shoulder": 40, "right_elbow": 41, "right_wrist": 42,
    "left_hip": 67, "left_knee": 68, "left_ankle": 69, "left_foot": 70,
    "right_hip": 72, "right_knee": 73, "right_ankle": 74, "right_foot": 75,
}  # fmt: skip
_SOMA_30 = {
    "pelvis": 0, "spine1": 1, "spine2": 2, "spine3": 3, "neck": 4, "head": 6,
    "left_collar": 10, "left_shoulder": 11, "left_elbow": 12, "left_wrist": 13,
    "right_collar": 16, "right_shoulder": 17, "right_elbow": 18, "right_wrist": 19,
    "left_hip": 22, "left_knee": 23, "left_ankle": 24, "left_foot": 25,
    "right_hip": 26, "right_knee": 27, "right_ankle": 28, "right_foot": 29,
}  # fmt: skip
KIMODO_JOINTS = {
    77: tuple(_SOMA_77[name] for name in BODY_JOINTS),
    30: tuple(_SOMA_30[name] for name in BODY_JOINTS),
    22: tuple(range(22)),
}


def plain_name(name: str) -> str:
    """A joint's name without what programs add: "mixamorig:LeftUpLeg" -> "leftupleg"."""
    lower = name.rpartition(":")[2].lower().removeprefix("mixamorig")
    return "".join(letter for letter in lower if letter.isalnum())


@dataclass(frozen=True)
class NameMatch:
    """The naming that fits best: our joint -> index in the file, and the required joints that it lacks there."""

    naming: Naming
    index: dict[str, int]
    missing: tuple[str, ...]


def match_names(names: list[str]) -> NameMatch:
    """The naming that finds most of our joints among ``names``, required ones first; earlier namings win ties."""
    place = {plain_name(name): index for index, name in reversed(list(enumerate(names)))}
    matches = []
    for naming in NAMINGS:
        index = {ours: place[theirs] for ours, theirs in naming.joints.items() if theirs in place}
        missing = tuple(naming.joints[name] for name in REQUIRED if name not in index)
        matches.append(NameMatch(naming, index, missing))
    return min(matches, key=lambda match: (len(match.missing), -len(match.index)))
