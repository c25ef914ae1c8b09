"""Who a person is: traits, complexion, hair and clothes, drawn from the seed."""

from dataclasses import dataclass

import numpy as np

from perpetua.actors.base.base_mesh import Traits
from perpetua.actors.bodies.hair_styles import STYLES, HairStyle
from perpetua.actors.bodies.skin import Complexion
from perpetua.actors.clothing.outfit import Outfit, draw_outfit
from perpetua.actors.config import ActorsConfig
from perpetua.seeding import StageSeed

# Linear RGB of skin from light to deep, along which each ancestry covers a range.
_TONES = np.array(
    [
        [0.55, 0.365, 0.285],
        [0.50, 0.31, 0.225],
        [0.43, 0.25, 0.17],
        [0.33, 0.18, 0.11],
        [0.18, 0.09, 0.055],
        [0.085, 0.042, 0.027],
    ]
)
_TONE_RANGES = {"african": (0.62, 1.0), "asian": (0.15, 0.5), "european": (0.0, 0.3)}
_HAIR = {
    "black": (0.010, 0.008, 0.007),
    "dark brown": (0.028, 0.016, 0.010),
    "brown": (0.075, 0.040, 0.021),
    "blond": (0.33, 0.20, 0.085),
    "red": (0.20, 0.060, 0.020),
    "grey": (0.30, 0.29, 0.28),
}
_IRIS = {
    "brown": (0.07, 0.03, 0.012),
    "hazel": (0.14, 0.09, 0.03),
    "blue": (0.10, 0.22, 0.36),
    "green": (0.12, 0.19, 0.10),
}
_MEN_HAIR = ("short", "side-parted", "swept-back", "buzzed", "short", "curly", "side-parted")
_WOMEN_HAIR = ("bob", "long", "tied-up", "wavy", "ponytail", "curly", "long", "short")
_STATURE_M = {False: (1.77, 0.065), True: (1.64, 0.06)}


@dataclass(frozen=True)
class Person:
    """Everything that makes one person, before any geometry; ``figure`` is part of ``description``."""

    traits: Traits
    stature_m: float
    details: tuple[tuple[str, float], ...]
    complexion: Complexion
    hair: HairStyle
    outfit: Outfit
    figure: str
    description: str


def _turn(actor: int, choices: int, rng: np.random.Generator) -> int:
    """The actor's entry of a shuffled round of choices: neighbours differ until all are used up."""
    return int(rng.permutation(choices)[actor % choices])


def _details(rng: np.random.Generator) -> tuple[tuple[str, float], ...]:
    """Small changes of the face, each a pair of opposite shape targets."""
    pairs = (
        ("nose/nose-scale-horiz-incr", "nose/nose-scale-horiz-decr"),
        ("nose/nose-scale-depth-incr", "nose/nose-scale-depth-decr"),
        ("chin/chin-width-incr", "chin/chin-width-decr"),
        ("chin/chin-height-incr", "chin/chin-height-decr"),
        ("head/head-scale-horiz-incr", "head/head-scale-horiz-decr"),
        ("forehead/forehead-scale-vert-incr", "forehead/forehead-scale-vert-decr"),
        ("mouth/mouth-scale-horiz-incr", "mouth/mouth-scale-horiz-decr"),
    )
    drawn = np.clip(rng.normal(0.0, 0.35, len(pairs)), -0.8, 0.8)
    return tuple(
        (more if value > 0 else less, abs(float(value))) for (more, less), value in zip(pairs, drawn, strict=True)
    )


def _hair_colour(ancestry: str, old: float, rng: np.random.Generator) -> str:
    if rng.random() < 1.3 * (old - 0.35):
        return "grey"
    if ancestry == "european":
        return ("dark brown", "brown", "brown", "blond", "blond", "red")[int(rng.integers(6))]
    return ("black", "black", "dark brown")[int(rng.integers(3))]


def _words(female: bool, age_years: int, weight: float, muscle: float, stature_m: float) -> str:
    build = "heavy" if weight > 0.72 else "slim" if weight < 0.36 else "athletic" if muscle > 0.68 else "average"
    return f"a {'woman' if female else 'man'} of about {age_years}, {round(100 * stature_m)} cm tall, {build} build"


def draw_person(actor: int, config: ActorsConfig, seed: StageSeed) -> Person:
    """One person of a room; sex, ancestry, age and build take turns so that a room's people differ."""
    room = seed.stream("people")
    rng = seed.stream("person", actor)
    female = (actor + int(room.integers(2))) % 2 == 0
    ancestry = ("european", "african", "asian")[_turn(actor, 3, room)]
    youth = (_turn(actor, 4, room) + float(rng.random())) / 4.0
    age_years = round(config.youngest_years + youth * (config.oldest_years - config.youngest_years))
    weight = 0.25 + 0.6 * (_turn(actor, 4, room) + float(rng.random())) / 4.0
    muscle = float(rng.uniform(0.32, 0.72))
    mean_m, deviation_m = _STATURE_M[female]
    stature_m = mean_m + deviation_m * float(np.clip(rng.normal(), -1.8, 1.8))
    fractions = {"african": 0.08, "asian": 0.08, "european": 0.08, ancestry: 0.84}
    old = min(max((age_years - 25.0) / 55.0, 0.0), 1.0)
    traits = Traits(
        female, 2.0 / 3.0 + old / 3.0, muscle, weight, 0.5, float(rng.uniform(0.0, 0.6)),
        fractions["african"], fractions["asian"], fractions["european"],
    )  # fmt: skip
    low, high = _TONE_RANGES[ancestry]
    depth = float(rng.uniform(low, high)) * (len(_TONES) - 1)
    tone = np.array([np.interp(depth, np.arange(len(_TONES)), _TONES[:, channel]) for channel in range(3)])
    hair_name = _hair_colour(ancestry, old, rng)
    irises = ("brown", "brown", "hazel") if ancestry != "european" else ("blue", "brown", "green", "hazel", "blue")
    iris = _IRIS[irises[int(rng.integers(len(irises)))]]
    beard = 0.0 if female else float(rng.choice([0.10, 0.18, 0.85], p=[0.45, 0.3, 0.25]))
    complexion = Complexion(
        tuple(tone.tolist()), _HAIR[hair_name], iris, beard, 0.0028 if female else 0.0042, float(age_years)
    )
    style_names = _WOMEN_HAIR if female else _MEN_HAIR
    style = STYLES[style_names[int(rng.integers(len(style_names)))]]
    if ancestry == "african" and rng.random() < 0.5:
        style = STYLES["afro" if female or rng.random() < 0.3 else "buzzed"]
    outfit = draw_outfit(actor, female, seed)
    figure = _words(female, age_years, weight, muscle, stature_m)
    words = f"{figure}, {style.name} {hair_name} hair, wearing {outfit.words}"
    return Person(traits, stature_m, _details(rng), complexion, style, outfit, figure, words)
