"""What words mean: which actions, in what manner, at what pace.

The rule: a description is cut into clauses at commas, "and", "then" and "while", a clause into words, each word reduced
to its stem ("waving", "waves": "wav"). A clause means an action when one of the action's verbs occurs in it and, where
the action names things or body parts, one of those too. Several actions can be meant at once ("walks while talking on
the phone and looking around"); where two want the same arm, the one said first has it. "left" or "right" in the clause
moves a one-handed action to that side. Words of manner ("briskly", "tired") change how the whole body moves. Words of
going and standing are always understood: how fast and where is the route's affair.
"""

import difflib
import logging
import re
from dataclasses import dataclass, replace

from perpetua.motion.vocabulary import ACTIONS, Action, HandPose

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class DescribedMotion:
    """The actions meant, in the order said, each for the side it is done with, and the manner of all motion."""

    actions: tuple[Action, ...] = ()
    lean_rad: float = 0.0
    arm_swing: float = 1.0

    @property
    def left(self) -> Action | None:
        """The action that has the left arm."""
        return next((action for action in self.actions if action.left is not None), None)

    @property
    def right(self) -> Action | None:
        """The action that has the right arm."""
        return next((action for action in self.actions if action.right is not None), None)


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
    return tuple(ACTIONS)


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


def mentioned_words(description: str) -> frozenset[str]:
    """The stems of all words of a description."""
    return frozenset().union(*_clauses(description))


def names(stems: frozenset[str], category: str) -> bool:
    """Whether words name a category of things, by any word of its name."""
    return bool(stems & _words(category.replace("_", " ")))


def read_description(description: str) -> DescribedMotion:
    """What a description in plain words asks of the body.

    Words that mean nothing known are logged as a warning that names the nearest known actions; the body then walks.
    """
    described = DescribedMotion()
    understood = False
    for stems in _clauses(description):
        meant = [action for action in ACTIONS.values() if _means(stems, action)]
        manners = [effect for word, effect in _MANNERS.items() if _stem(word) in stems]
        understood = understood or bool(meant or manners or stems & _GOING or stated_paces(" ".join(stems)))
        for lean_rad, swing in manners:
            described = replace(
                described, lean_rad=described.lean_rad + lean_rad, arm_swing=described.arm_swing * swing
            )
        known = {action.verbs for action in described.actions}
        for action in (action for action in meant if action.verbs not in known):
            described = _with_action(described, action, stems)
    if not understood:
        near = difflib.get_close_matches(description.lower(), ACTIONS, n=3, cutoff=0.0)
        logger.warning("action '%s' is not understood, so the actor walks; the nearest known are %s", description, near)
    return described


def _clauses(description: str) -> list[frozenset[str]]:
    """The stems of the words of each clause."""
    clauses = re.split(r"[,;.]|\band\b|\bwhile\b|\bthen\b", description.lower())
    return [frozenset(_stem(word) for word in re.findall(r"[a-z]+", clause)) for clause in clauses]


def _means(stems: frozenset[str], action: Action) -> bool:
    things = _words(action.things)
    return bool(stems & _words(action.verbs)) and (not things or bool(stems & things))


def _with_action(described: DescribedMotion, action: Action, stems: frozenset[str]) -> DescribedMotion:
    """One more action: on the side that words name, and with the arms that are still free."""
    one_handed = (action.left is None) != (action.right is None)
    if one_handed:
        pose = action.right if action.right is not None else action.left
        on_left = "left" in stems if action.right is not None else "right" not in stems
        action = replace(action, right=None if on_left else pose, left=pose if on_left else None)
    return replace(
        described,
        actions=(
            *described.actions,
            replace(
                action,
                right=_free(action.right, described.right),
                left=_free(action.left, described.left),
            ),
        ),
    )


def _free(pose: HandPose | None, taken: Action | None) -> HandPose | None:
    return pose if taken is None else None
