"""What words make the upper body do.

The rule: a description is cut into words, each reduced to its stem ("waving", "waves" -> "wave"). An action is meant
when one of its verbs occurs and, where it names things or body parts, one of those too. Several actions can be meant
at once ("walks while talking on the phone and looking around"); where two want the same arm, the earlier of the table
has it. "left" or "right" moves a one-handed action to that side. Words of manner ("briskly", "tired") change how the
whole body moves. Words of going and standing are always understood: how fast and where is the route's affair.
"""

import difflib
import logging
import re
from dataclasses import dataclass, replace
from typing import Literal

logger = logging.getLogger(__name__)

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class HandReach:
    """A hand held somewhere: (forward, outward, up) in the chest's frame.

    ``wrist`` is relative to the shoulder, in lengths of the arm; ``elbow_towards`` is where the elbow stands out;
    ``swing`` is how far the wrist moves along ``swing_along`` (lengths of the arm) at ``swing_hz``.
    """

    wrist: Vector
    elbow_towards: Vector
    swing_along: Vector = (0.0, 0.0, 0.0)
    swing_hz: float = 0.0


@dataclass(frozen=True)
class Performance:
    """What the upper body does: arms that do not hang (left, right), how far the head wanders, and the manner."""

    left: HandReach | None = None
    right: HandReach | None = None
    gaze_wander_rad: float = 0.12
    gaze_pitch_rad: float = 0.0
    lean_rad: float = 0.0
    arm_swing: float = 1.0


@dataclass(frozen=True)
class _Action:
    """``verbs`` and ``things`` are stems; ``hands`` "one" means the right hand unless the words say left."""

    verbs: frozenset[str]
    things: frozenset[str]
    hands: Literal["none", "one", "both"]
    reach: HandReach | None = None
    gaze_wander_rad: float | None = None
    gaze_pitch_rad: float = 0.0


def _stem(word: str) -> str:
    """A word without the endings of English verbs, plurals and adverbs, nor a final vowel or doubled consonant."""
    for ending in ("ing", "ly", "ed", "es", "s"):
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            word = word[: -len(ending)]
            break
    if len(word) > 3 and word[-1] in "eiy":
        word = word[:-1]
    return word[:-1] if len(word) > 3 and word[-1] == word[-2] else word


def _words(text: str) -> frozenset[str]:
    return frozenset(_stem(word) for word in text.split())


_PHONE = HandReach((0.12, -0.05, 0.30), (0.55, 0.75, -0.6))
_SCREEN = HandReach((0.47, -0.22, -0.12), (-0.2, 0.45, -1.0))
_WAVE = HandReach((0.22, 0.42, 0.36), (-0.1, 1.0, -0.35), (0.0, 0.13, 0.0), 1.5)
_BOX = HandReach((0.56, -0.02, -0.36), (-0.6, 0.5, -1.0))
_TRAY = HandReach((0.52, -0.05, -0.22), (-0.3, 0.5, -1.0))
_HANDS_IN_FRONT = HandReach((0.34, -0.24, -0.62), (-0.5, 1.0, 0.0))
_HANDS_BEHIND = HandReach((-0.24, -0.2, -0.76), (-0.6, 1.0, 0.2))
_HANDS_ON_HIPS = HandReach((0.08, 0.04, -0.66), (-0.6, 1.0, 0.1))
_ARMS_CROSSED = HandReach((0.36, -0.42, -0.3), (0.0, 0.7, -1.0))
_POINT = HandReach((0.93, 0.1, 0.02), (-0.3, 0.6, -1.0))
_GESTURE = HandReach((0.45, 0.05, -0.3), (-0.5, 0.6, -1.0), (0.06, 0.06, 0.06), 0.8)

_ACTIONS: dict[str, _Action] = {
    "talk on the phone": _Action(_words("talk speak call phone chat"), _words("phone telephone mobile"), "one", _PHONE),
    "look at the phone": _Action(
        _words("look read type text check"), _words("phone screen message"), "one", _SCREEN, 0.05, 0.3
    ),
    "wave": _Action(_words("wave greet"), frozenset(), "one", _WAVE),
    "carry a box": _Action(_words("carry hold bring lift"), _words("box parcel crate basket"), "both", _BOX),
    "carry a tray": _Action(_words("carry hold bring serve"), _words("tray plate dish"), "both", _TRAY),
    "point": _Action(_words("point"), frozenset(), "one", _POINT),
    "arms crossed": _Action(_words("cross fold"), _words("arm"), "both", _ARMS_CROSSED),
    "hands on hips": _Action(_words("hand put rest"), _words("hip waist"), "both", _HANDS_ON_HIPS),
    "hands behind the back": _Action(_words("hand clasp hold"), _words("behind back"), "both", _HANDS_BEHIND),
    "hands in front": _Action(_words("hand clasp hold"), _words("front belly"), "both", _HANDS_IN_FRONT),
    "gesture": _Action(_words("gesture explain argue discuss"), frozenset(), "one", _GESTURE),
    "look around": _Action(_words("look glance gaze watch"), _words("around about room"), "none", None, 0.55),
    "look down": _Action(_words("look glance gaze watch"), _words("down floor ground"), "none", None, 0.08, 0.35),
}
_GOING = _words("walk stroll go move pace wander step stride march amble saunter turn stand wait stop idle pause hurry")
_MANNERS: dict[str, tuple[float, float]] = {
    # Forward lean in radians, arm swing as a factor.
    "brisk": (0.03, 1.25),
    "hurry": (0.05, 1.3),
    "march": (0.0, 1.5),
    "tired": (0.09, 0.7),
    "slow": (0.02, 0.85),
    "relax": (-0.02, 0.9),
    "proud": (-0.05, 1.1),
}


def known_actions() -> tuple[str, ...]:
    """Names of the actions that descriptions can mean."""
    return tuple(_ACTIONS)


def perform(description: str) -> Performance:
    """What a description in plain words asks of the upper body.

    Words that mean nothing known are logged as a warning that names the nearest known actions; the body then walks.
    """
    stems = frozenset(_stem(word) for word in re.findall(r"[a-z]+", description.lower()))
    meant = [action for action in _ACTIONS.values() if stems & action.verbs and _mentions(stems, action)]
    manners = [effect for word, effect in _MANNERS.items() if _stem(word) in stems]
    if not meant and not manners and not stems & _GOING:
        near = difflib.get_close_matches(description.lower(), _ACTIONS, n=3, cutoff=0.0)
        logger.warning("action '%s' is not understood, so the actor walks; known are for example %s", description, near)
    performance = Performance()
    for lean_rad, swing in manners:
        performance = replace(
            performance, lean_rad=performance.lean_rad + lean_rad, arm_swing=performance.arm_swing * swing
        )
    for action in meant:
        performance = _with_action(performance, action, "left" in stems)
    return performance


def _mentions(stems: frozenset[str], action: _Action) -> bool:
    return not action.things or bool(stems & action.things)


def _with_action(performance: Performance, action: _Action, use_left: bool) -> Performance:
    left, right = performance.left, performance.right
    if left is None and (action.hands == "both" or (action.hands == "one" and use_left)):
        left = action.reach
    if right is None and (action.hands == "both" or (action.hands == "one" and not use_left)):
        right = action.reach
    wander_rad = performance.gaze_wander_rad if action.gaze_wander_rad is None else action.gaze_wander_rad
    pitch_rad = max(performance.gaze_pitch_rad, action.gaze_pitch_rad)
    return replace(performance, left=left, right=right, gaze_wander_rad=wander_rad, gaze_pitch_rad=pitch_rad)
