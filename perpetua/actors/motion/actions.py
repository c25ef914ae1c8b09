"""What words make the upper body do.

The rule: a description is cut into clauses at commas, "and" and "while", a clause into words, each word reduced to
its stem ("waving", "waves": "wav"). A clause means an action when one of the action's verbs occurs in it and, where
the action names things or body parts, one of those too. Several actions can be meant at once ("walks while talking on
the phone and looking around"); where two want the same arm, the one said first has it. "left" or "right" in the clause
moves a one-handed action to that side. Words of manner ("briskly", "tired") change how the whole body moves. Words of
going and standing are always understood: how fast and where is the route's affair.
"""

import difflib
import logging
import re
from dataclasses import dataclass, replace

logger = logging.getLogger(__name__)

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class HandReach:
    """A hand held somewhere: (forward, outward, up) in the chest's frame.

    ``wrist`` is relative to the shoulder, in lengths of the arm; ``elbow_towards`` is where the elbow stands out;
    ``roll_rad`` turns the forearm about itself (negative: thumb side out); ``swing`` is how far the wrist moves to
    and fro (lengths of the arm) at ``swing_hz``.
    """

    wrist: Vector
    elbow_towards: Vector
    roll_rad: float = 0.0
    swing: Vector = (0.0, 0.0, 0.0)
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
    """``verbs`` and ``things`` are stems; one-handed where ``left`` is None: then the right unless words say left."""

    verbs: frozenset[str]
    things: frozenset[str]
    right: HandReach | None = None
    left: HandReach | None = None
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


_PHONE = HandReach((0.19, 0.03, 0.17), (0.3, 0.6, -1.0), roll_rad=-1.2)
_SCREEN = HandReach((0.47, -0.22, -0.12), (-0.2, 0.45, -1.0), roll_rad=-0.8)
_WAVE = HandReach((0.3, 0.2, 0.28), (0.1, 0.8, -1.0), swing=(0.0, 0.11, 0.0), swing_hz=1.5)
_POINT = HandReach((0.93, 0.1, 0.02), (-0.3, 0.6, -1.0))
_GESTURE = HandReach((0.45, 0.05, -0.3), (-0.5, 0.6, -1.0), swing=(0.06, 0.06, 0.06), swing_hz=0.8)
_BOX = HandReach((0.56, 0.0, -0.36), (-0.6, 0.5, -1.0))
_TRAY = HandReach((0.52, -0.05, -0.3), (-0.4, 0.5, -1.0), roll_rad=-1.3)
# Of two hands that meet, one is in front of the other.
_CROSSED = (
    HandReach((0.46, -0.38, -0.28), (0.0, 0.7, -1.0)),
    HandReach((0.34, -0.38, -0.36), (0.0, 0.7, -1.0)),
)
_ON_HIPS = HandReach((0.06, 0.1, -0.64), (-0.6, 1.0, 0.1))
_BEHIND = (
    HandReach((-0.44, -0.16, -0.72), (-0.4, 1.0, 0.1)),
    HandReach((-0.36, -0.16, -0.76), (-0.4, 1.0, 0.1)),
)
_IN_FRONT = (
    HandReach((0.44, -0.12, -0.6), (-0.5, 1.0, 0.0)),
    HandReach((0.36, -0.12, -0.64), (-0.5, 1.0, 0.0)),
)

_ACTIONS: dict[str, _Action] = {
    "talk on the phone": _Action(_words("talk speak call chat"), _words("phone telephone mobile"), _PHONE),
    "look at the phone": _Action(
        _words("look read type text check"), _words("phone screen message"), _SCREEN, None, 0.05, 0.3
    ),
    "wave a hand": _Action(_words("wave greet"), frozenset(), _WAVE),
    "point ahead": _Action(_words("point"), frozenset(), _POINT),
    "gesture with a hand": _Action(_words("gesture explain argue discuss"), frozenset(), _GESTURE),
    "carry a box": _Action(_words("carry hold bring lift"), _words("box parcel crate basket"), _BOX, _BOX),
    "carry a tray": _Action(_words("carry hold bring serve"), _words("tray plate dish"), _TRAY, _TRAY),
    "cross the arms": _Action(_words("cross fold"), _words("arm"), *_CROSSED),
    "hands on the hips": _Action(_words("hand put rest"), _words("hip waist"), _ON_HIPS, _ON_HIPS),
    "hands behind the back": _Action(_words("hand clasp hold"), _words("behind back"), *_BEHIND),
    "hands in front": _Action(_words("hand clasp hold"), _words("front belly"), *_IN_FRONT),
    "look around": _Action(_words("look glance gaze watch"), _words("around about room"), gaze_wander_rad=0.55),
    "look down": _Action(
        _words("look glance gaze watch"), _words("down floor ground"), gaze_wander_rad=0.08, gaze_pitch_rad=0.35
    ),
}
_GOING = _words("walk stroll go move pace wander step stride march amble saunter turn stand wait stop idle pause hurry")
_PACE_VERBS = {
    "stand": _words("stand wait idle halt"),
    "stroll": _words("stroll amble saunter wander"),
    "walk": _words("walk go pace march stride move"),
    "brisk": _words("hurry rush"),
    "jog": _words("jog run"),
}
_PACE_OF_MANNER = {
    "brisk": "brisk", "quick": "brisk", "fast": "brisk", "hurried": "brisk",
    "slow": "stroll", "tired": "stroll", "leisurely": "stroll",
}  # fmt: skip
_SITTING = _words("sit sits sitting seat")
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


def stated_paces(description: str) -> frozenset[str]:
    """The paces of ``actors.types.PACES`` that a description states; empty where it says nothing of going or standing.

    A word of manner outweighs the verb in its clause: "walks briskly" is brisk, "walks" is walk.
    """
    stated: set[str] = set()
    for stems in _clauses(description):
        manner = {pace for word, pace in _PACE_OF_MANNER.items() if _stem(word) in stems}
        verb = {pace for pace, words in _PACE_VERBS.items() if stems & words}
        stated |= manner if manner and (verb <= {"walk"}) else verb
    return frozenset(stated)


def wants_seat(description: str) -> bool:
    """Whether a description asks for a place to sit."""
    return any(stems & _SITTING for stems in _clauses(description))


def _clauses(description: str) -> list[frozenset[str]]:
    """The stems of the words of each clause."""
    clauses = re.split(r"[,;.]|\band\b|\bwhile\b|\bthen\b", description.lower())
    return [frozenset(_stem(word) for word in re.findall(r"[a-z]+", clause)) for clause in clauses]


def perform(description: str) -> Performance:
    """What a description in plain words asks of the upper body.

    Words that mean nothing known are logged as a warning that names the nearest known actions; the body then walks.
    """
    performance = Performance()
    understood = False
    for stems in _clauses(description):
        meant = [action for action in _ACTIONS.values() if stems & action.verbs and _mentions(stems, action)]
        manners = [effect for word, effect in _MANNERS.items() if _stem(word) in stems]
        understood = understood or bool(meant or manners or stems & _GOING)
        for lean_rad, swing in manners:
            performance = replace(
                performance, lean_rad=performance.lean_rad + lean_rad, arm_swing=performance.arm_swing * swing
            )
        for action in meant:
            performance = _with_action(performance, action, "left" in stems)
    if not understood:
        near = difflib.get_close_matches(description.lower(), _ACTIONS, n=3, cutoff=0.0)
        logger.warning("action '%s' is not understood, so the actor walks; the nearest known are %s", description, near)
    return performance


def _mentions(stems: frozenset[str], action: _Action) -> bool:
    return not action.things or bool(stems & action.things)


def _with_action(performance: Performance, action: _Action, use_left: bool) -> Performance:
    one_handed = action.left is None
    wanted_left = action.left if not one_handed else (action.right if use_left else None)
    wanted_right = None if one_handed and use_left else action.right
    wander_rad = performance.gaze_wander_rad if action.gaze_wander_rad is None else action.gaze_wander_rad
    return replace(
        performance,
        left=performance.left if performance.left is not None else wanted_left,
        right=performance.right if performance.right is not None else wanted_right,
        gaze_wander_rad=wander_rad,
        gaze_pitch_rad=max(performance.gaze_pitch_rad, action.gaze_pitch_rad),
    )
