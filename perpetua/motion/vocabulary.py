"""The actions that words can mean: which words mean them, and what body parts do.

Hands are placed relative to the shoulder in the chest's frame, (forward, outward, up), in lengths of the arm, so that
an action fits every body. One-handed actions are told for the right hand.
"""

from dataclasses import dataclass

Vector = tuple[float, float, float]
NOTHING: Vector = (0.0, 0.0, 0.0)
# Held for as long as the actor moves.
ALWAYS = (0.0, 0.0)


@dataclass(frozen=True)
class HandPose:
    """A hand held somewhere.

    ``wrist`` is where; the elbow stands out ``elbow_towards``, the palm looks ``palm_towards`` as far as the forearm
    turns; ``flex_rad`` bends the wrist towards the palm; ``fingers`` names a shape of the hand. The hand moves to and
    fro by ``swing`` and bends by ``beat_rad`` at ``swing_hz``, the left ``lag`` cycles behind the right.
    """

    wrist: Vector
    elbow_towards: Vector
    palm_towards: Vector
    flex_rad: float = 0.0
    fingers: str = "relaxed"
    swing: Vector = NOTHING
    beat_rad: float = 0.0
    swing_hz: float = 0.0
    lag: float = 0.0


@dataclass(frozen=True)
class Move:
    """What trunk and head do while an action is at its height; angles in radians, ``drop`` in lengths of the leg.

    ``lean`` is forward, ``tilt`` to the right, ``turn`` to the left; ``nod`` and ``shake`` are to and fro at ``hz``, as
    are ``sway`` (the trunk, sideways) and ``bounce`` (the knees, lengths of the leg).
    """

    lean: float = 0.0
    turn: float = 0.0
    drop: float = 0.0
    shrug: float = 0.0
    sway: float = 0.0
    bounce: float = 0.0
    head_pitch: float = 0.0
    head_turn: float = 0.0
    head_tilt: float = 0.0
    wander: float = 0.0
    nod: float = 0.0
    shake: float = 0.0
    hz: float = 0.0


@dataclass(frozen=True)
class Action:
    """``verbs`` and ``things`` are words; an action is meant where one of each occurs (no things: a verb is enough).

    One-handed where ``left`` is None. ``hold_s`` and ``pause_s`` are the least and most seconds that it is kept up and
    left off, ``rise_s`` how long it takes to begin. Meanwhile hands hang, or are held as in ``between``. ``standing``
    actions wait until the actor stands; ``aims`` points the hand at what the words or the route are about.
    """

    verbs: str
    things: str = ""
    right: HandPose | None = None
    left: HandPose | None = None
    between: HandPose | None = None
    move: Move = Move()
    hold_s: tuple[float, float] = ALWAYS
    pause_s: tuple[float, float] = (2.5, 5.0)
    rise_s: float = 0.6
    standing: bool = False
    aims: bool = False


def _both(pose: HandPose) -> tuple[HandPose, HandPose]:
    return pose, pose


_LOOK = "look glance gaze watch peer stare"
_HAND = "hand put rest keep clasp hold"
_UP, _IN, _AHEAD = (0.0, 0.0, 1.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)
_BACK = (-1.0, 0.0, 0.0)
_HANDSET = HandPose((0.22, 0.02, 0.15), (-0.5, 0.3, -1.0), (-0.3, -1.0, 0.1), 0.0, "grip")
_SCREEN = HandPose((0.45, -0.24, -0.16), (-0.2, 0.45, -1.0), (-0.8, -0.2, 0.6), 0.1, "grip")
_WAVE = HandPose(
    (0.30, 0.24, 0.30), (0.0, 0.8, -1.0), _AHEAD, 0.0, "flat", swing=(0.0, 0.10, 0.0), beat_rad=0.0, swing_hz=1.6
)
_POINT = HandPose((0.93, 0.05, 0.02), (-0.2, 0.7, -1.0), (0.0, -0.5, -1.0), 0.0, "point")
_TALKING_HAND = HandPose(
    (0.46, 0.02, -0.36), (-0.5, 0.6, -1.0), (0.1, -0.6, 1.0), swing=(0.05, 0.07, 0.07), beat_rad=0.2, swing_hz=0.75
)
_BOX = HandPose((0.60, -0.03, -0.44), (-0.6, 0.5, -1.0), _IN, 0.0, "flat")
_TRAY = HandPose((0.56, -0.05, -0.34), (-0.4, 0.5, -1.0), _UP, 0.0, "flat")
# Of two hands that meet, one is in front of the other.
_CROSSED = (
    HandPose((0.52, -0.40, -0.34), (-0.1, 0.8, -1.0), (-1.0, -0.2, 0.0), 0.2),
    HandPose((0.40, -0.40, -0.42), (-0.1, 0.8, -1.0), (-1.0, -0.2, 0.0), 0.2),
)
_HIP = HandPose((0.02, 0.16, -0.72), (-0.5, 1.0, 0.2), (0.2, -1.0, 0.0), 0.5)
_BEHIND = (
    HandPose((-0.42, -0.22, -0.80), (-0.5, 1.0, 0.2), _BACK),
    HandPose((-0.34, -0.22, -0.86), (-0.5, 1.0, 0.2), _BACK),
)
_IN_FRONT = (
    HandPose((0.46, -0.28, -0.68), (-0.5, 1.0, 0.0), _BACK, 0.1),
    HandPose((0.38, -0.28, -0.74), (-0.5, 1.0, 0.0), _BACK, 0.1),
)
_POCKET = HandPose((0.05, 0.08, -0.86), (-0.8, 0.8, 0.0), _IN, 0.0, "fist")
_CHEST_CUP = HandPose((0.46, -0.10, -0.44), (-0.3, 0.5, -1.0), _IN, 0.0, "grip")
_MOUTH = HandPose((0.40, -0.26, 0.14), (0.2, 0.7, -1.0), (-0.5, -1.0, 0.0), 0.2, "grip")

ACTIONS: dict[str, Action] = {
    "talk on the phone": Action(
        "talk speak call chat", "phone telephone mobile", _HANDSET, move=Move(head_tilt=0.08, nod=0.03, hz=0.4)
    ),
    "look at the phone": Action(
        "look read type text check scroll", "phone screen message", _SCREEN, move=Move(head_pitch=0.32, wander=-0.07)
    ),
    "wave a hand": Action("wave greet", "", _WAVE, hold_s=(1.8, 3.5), pause_s=(2.0, 5.0), rise_s=0.5),
    "point at something": Action(
        "point", "", _POINT, hold_s=(1.6, 3.0), pause_s=(2.0, 4.5), rise_s=0.55, aims=True
    ),
    "gesture with a hand": Action(
        "gesture explain argue discuss", "", _TALKING_HAND, hold_s=(2.5, 5.0), pause_s=(1.0, 3.0), rise_s=0.5
    ),
    "carry a box": Action("carry hold bring lift", "box parcel crate basket", *_both(_BOX), rise_s=0.8),
    "carry a tray": Action("carry hold bring serve", "tray plate dish", *_both(_TRAY), rise_s=0.8),
    "cross the arms": Action("cross fold", "arm", *_CROSSED, rise_s=0.9),
    "hug oneself": Action(
        "hug embrace shiver freeze", "",
        HandPose((0.44, -0.50, -0.16), (0.3, 0.6, -1.0), _BACK, 0.3),
        HandPose((0.33, -0.50, -0.28), (0.3, 0.6, -1.0), _BACK, 0.3),
        move=Move(lean=0.08, shrug=0.15), hold_s=(3.0, 6.0), pause_s=(1.5, 3.0), rise_s=0.9,
    ),
    "hands on the hips": Action(_HAND, "hip waist", *_both(_HIP), rise_s=0.8),
    "hands behind the back": Action(_HAND, "behind back", *_BEHIND, rise_s=0.9),
    "hands in front": Action(_HAND, "front belly", *_IN_FRONT, rise_s=0.9),
    "hands in the pockets": Action(_HAND, "pocket", *_both(_POCKET), rise_s=0.8),
    "look around": Action(_LOOK, "around about room", move=Move(wander=0.45)),
    "look down": Action(_LOOK, "down floor ground", move=Move(head_pitch=0.38, wander=-0.06)),
    "look up": Action(
        _LOOK, "up ceiling", move=Move(head_pitch=-0.5, lean=-0.06), hold_s=(1.8, 3.5), pause_s=(1.5, 3.0)
    ),
    "stretch": Action(
        "stretch", "",
        HandPose((0.02, 0.30, 0.93), (0.0, 1.0, -0.2), (0.5, -0.5, 0.0), 0.0, "fist"),
        HandPose((-0.02, 0.24, 0.95), (0.0, 1.0, -0.2), (0.5, -0.5, 0.0), 0.0, "fist"),
        move=Move(lean=-0.16, head_pitch=-0.25, shrug=0.2), hold_s=(1.6, 2.6), pause_s=(3.0, 6.0), rise_s=1.1,
    ),
    "raise the arms": Action(
        "raise lift cheer celebrate", "arm overhead hands",
        *_both(HandPose((0.12, 0.30, 0.88), (0.0, 1.0, 0.0), _AHEAD, 0.0, "flat",
                                  swing=(0.02, 0.06, 0.03), swing_hz=0.9, lag=0.3)),
        hold_s=(2.0, 3.5), pause_s=(2.0, 4.0), rise_s=0.8,
    ),
    "scratch the head": Action(
        "scratch", "head hair",
        HandPose((0.18, -0.02, 0.47), (0.3, 1.0, 0.0), (-0.3, -1.0, -0.4), 0.5, "claw",
                 swing=(0.035, 0.0, 0.02), swing_hz=2.6),
        move=Move(head_pitch=0.1, head_tilt=0.08), hold_s=(1.8, 3.0), pause_s=(3.0, 6.0), rise_s=0.7,
    ),
    "rub the neck": Action(
        "rub massage", "neck shoulder",
        HandPose((0.06, -0.12, 0.42), (0.5, 1.0, 0.3), _IN, 0.5, "claw", swing=(0.02, 0.0, 0.03), swing_hz=1.2),
        move=Move(head_pitch=0.2, head_tilt=-0.1), hold_s=(2.0, 3.5), pause_s=(3.0, 6.0), rise_s=0.8,
    ),
    "touch the chin": Action(
        "think ponder touch stroke rub wonder", "think ponder wonder chin beard face",
        HandPose((0.34, -0.26, 0.03), (0.1, 0.45, -1.0), (-0.9, -0.3, 0.2), 0.15, "fist"),
        move=Move(head_pitch=0.12, head_tilt=0.06), hold_s=(3.0, 6.0), pause_s=(2.0, 4.0), rise_s=0.8,
    ),
    "clap": Action(
        "clap applaud", "",
        *_both(HandPose((0.52, -0.20, -0.22), (-0.3, 0.8, -1.0), _IN, 0.0, "flat",
                                  swing=(0.0, 0.12, 0.0), swing_hz=2.1)),
        hold_s=(2.2, 3.8), pause_s=(1.5, 3.5), rise_s=0.5,
    ),
    "rub the hands": Action(
        "rub wash warm", "hand",
        HandPose((0.50, -0.27, -0.40), (-0.3, 0.8, -1.0), _IN, 0.0, "flat", swing=(0.06, 0.0, 0.05), swing_hz=1.6),
        HandPose((0.50, -0.27, -0.40), (-0.3, 0.8, -1.0), _IN, 0.0, "flat", swing=(0.06, 0.0, 0.05), swing_hz=1.6,
                 lag=0.5),
        hold_s=(2.0, 4.0), pause_s=(1.5, 3.5), rise_s=0.6,
    ),
    "drink from a cup": Action(
        "drink sip", "", _MOUTH, between=_CHEST_CUP, move=Move(head_pitch=-0.22),
        hold_s=(1.0, 1.8), pause_s=(2.5, 4.5), rise_s=0.8,
    ),
    "check the watch": Action(
        "check look", "watch time wrist",
        None, HandPose((0.44, -0.26, -0.12), (-0.1, 0.9, -0.5), (0.3, 0.2, -1.0), 0.1, "fist"),
        move=Move(head_pitch=0.34, head_turn=0.18), hold_s=(1.2, 2.2), pause_s=(3.0, 6.0), rise_s=0.6,
    ),
    "adjust the glasses": Action(
        "adjust push straighten fix", "glasses spectacles",
        HandPose((0.36, -0.13, 0.29), (0.3, 0.9, -0.8), (-0.5, -1.0, 0.0), 0.15, "point",
                 swing=(0.015, 0.0, 0.01), swing_hz=1.5),
        move=Move(head_pitch=0.08), hold_s=(0.8, 1.4), pause_s=(3.0, 6.0), rise_s=0.55,
    ),
    "wipe the forehead": Action(
        "wipe mop", "forehead brow sweat face",
        HandPose((0.32, -0.22, 0.40), (0.4, 1.0, -0.1), _BACK, 0.1, "relaxed", swing=(0.0, 0.14, 0.0), swing_hz=0.7),
        move=Move(head_pitch=0.08), hold_s=(1.4, 2.2), pause_s=(3.0, 6.0), rise_s=0.7,
    ),
    "brush back the hair": Action(
        "brush sweep tuck smooth", "hair",
        HandPose((0.14, -0.02, 0.52), (0.3, 1.0, 0.1), (-0.4, -1.0, -0.3), 0.3, "flat",
                 swing=(-0.10, 0.0, -0.05), swing_hz=0.6),
        move=Move(head_tilt=-0.06), hold_s=(1.0, 1.7), pause_s=(3.5, 6.5), rise_s=0.6,
    ),
    "yawn": Action(
        "yawn cough", "",
        HandPose((0.38, -0.28, 0.13), (0.2, 0.8, -1.0), _BACK, 0.1, "flat"),
        move=Move(head_pitch=-0.22, lean=-0.04, shrug=0.12), hold_s=(1.5, 2.4), pause_s=(4.0, 7.0), rise_s=0.8,
    ),
    "salute": Action(
        "salute", "",
        HandPose((0.25, 0.03, 0.33), (0.2, 1.0, 0.0), (0.2, -0.6, -1.0), 0.0, "flat"),
        hold_s=(1.4, 2.4), pause_s=(2.5, 5.0), rise_s=0.5,
    ),
    "thumbs up": Action(
        "thumb approve", "", HandPose((0.62, 0.05, -0.16), (-0.2, 0.5, -1.0), _IN, 0.0, "thumb"),
        move=Move(nod=0.06, hz=1.2), hold_s=(1.4, 2.4), pause_s=(2.5, 5.0), rise_s=0.5,
    ),
    "shrug": Action(
        "shrug", "",
        *_both(HandPose((0.40, 0.26, -0.46), (-0.5, 0.3, -1.0), _UP, -0.2, "flat")),
        move=Move(shrug=0.32, head_tilt=0.12), hold_s=(0.6, 1.1), pause_s=(2.0, 4.5), rise_s=0.4,
    ),
    "nod": Action("nod agree", "", move=Move(nod=0.17, hz=1.3), hold_s=(1.4, 2.6), pause_s=(1.5, 3.5), rise_s=0.3),
    "shake the head": Action(
        "shake disagree", "head disagree", move=Move(shake=0.30, hz=1.2), hold_s=(1.6, 2.8), pause_s=(1.5, 3.5),
        rise_s=0.3,
    ),
    "bow": Action(
        "bow", "", move=Move(lean=0.75, head_pitch=0.25), hold_s=(0.8, 1.4), pause_s=(2.5, 4.5), rise_s=0.9,
        standing=True,
    ),
    "bend down": Action(
        "bend pick stoop", "",
        HandPose((0.62, -0.02, -0.72), (-0.3, 0.6, 0.2), _IN, 0.1, "relaxed"),
        move=Move(lean=0.85, drop=0.2, head_pitch=0.0), hold_s=(0.9, 1.6), pause_s=(2.5, 4.5), rise_s=1.0,
        standing=True,
    ),
    "crouch and tie a shoe": Action(
        "crouch squat kneel tie", "",
        *_both(HandPose((0.62, -0.16, -0.60), (-0.2, 0.9, 0.1), _IN, 0.2, "grip",
                                  swing=(0.02, 0.03, 0.02), swing_hz=1.1, lag=0.4)),
        move=Move(lean=0.45, drop=0.36, head_pitch=0.1), hold_s=(2.0, 3.2), pause_s=(2.5, 4.5), rise_s=1.1,
        standing=True,
    ),
    "reach up": Action(
        "reach", "up high above top", HandPose((0.36, 0.05, 0.88), (0.0, 0.9, -0.4), _AHEAD, 0.0, "flat"),
        move=Move(head_pitch=-0.35, lean=-0.04, shrug=0.12), hold_s=(1.2, 2.4), pause_s=(2.5, 4.5), rise_s=0.8,
    ),
    "reach out": Action(
        "reach stretch extend offer", "out forward hand ahead",
        HandPose((0.90, -0.02, -0.16), (-0.2, 0.7, -1.0), (0.0, -1.0, 0.5), 0.0, "flat"),
        move=Move(lean=0.14, turn=0.12), hold_s=(1.2, 2.2), pause_s=(2.5, 4.5), rise_s=0.7,
    ),
    "dance": Action(
        "dance sway groove", "",
        HandPose((0.42, 0.16, -0.24), (-0.4, 0.7, -1.0), (0.3, -0.8, 0.3), 0.0, "fist", swing=(0.08, 0.06, 0.12),
                 swing_hz=0.95),
        HandPose((0.42, 0.16, -0.24), (-0.4, 0.7, -1.0), (0.3, -0.8, 0.3), 0.0, "fist", swing=(0.08, 0.06, 0.12),
                 swing_hz=0.95, lag=0.5),
        move=Move(sway=0.13, bounce=0.012, nod=0.06, hz=0.95), rise_s=0.8,
    ),
    "sit down": Action("sit seat", ""),
}  # fmt: skip
