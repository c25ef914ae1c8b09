"""What a person wears, drawn from the seed, and the pieces made of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from perpetua.actors.bodies.makehuman import base_mesh
from perpetua.actors.bodies.rig import base_weights
from perpetua.actors.clothing.fabrics import weave
from perpetua.actors.clothing.patterns import (
    SkirtPattern,
    TopPattern,
    TrouserPattern,
    covered_by,
    skirt_field_m,
    top_field_m,
    trouser_field_m,
)
from perpetua.actors.clothing.piece import Piece
from perpetua.actors.clothing.shoes import Footing, ShoePattern, make_shoes, shoe_field_m
from perpetua.actors.clothing.tailor import sew_skirt, sew_top, sew_trousers
from perpetua.actors.clothing.wearer import Wearer
from perpetua.seeding import StageSeed

Colour = tuple[float, float, float]

# Linear RGB of dyes, by the names used in descriptions.
DYES: dict[str, Colour] = {
    "white": (0.72, 0.71, 0.68),
    "cream": (0.66, 0.58, 0.42),
    "grey": (0.20, 0.21, 0.22),
    "charcoal": (0.035, 0.037, 0.042),
    "navy": (0.012, 0.022, 0.075),
    "blue": (0.035, 0.13, 0.40),
    "sky": (0.26, 0.45, 0.66),
    "teal": (0.012, 0.17, 0.18),
    "green": (0.035, 0.16, 0.055),
    "olive": (0.11, 0.115, 0.035),
    "mustard": (0.55, 0.30, 0.025),
    "orange": (0.60, 0.16, 0.025),
    "red": (0.42, 0.025, 0.030),
    "burgundy": (0.12, 0.010, 0.022),
    "pink": (0.60, 0.24, 0.29),
    "purple": (0.13, 0.045, 0.23),
    "brown": (0.13, 0.060, 0.028),
    "beige": (0.46, 0.35, 0.23),
}
_TOP_DYES = ("white", "teal", "red", "navy", "mustard", "green", "pink", "sky", "burgundy", "orange", "purple", "grey")
_LEG_DYES = ("navy", "charcoal", "beige", "olive", "grey", "brown")
_TOPS: dict[str, TopPattern] = {
    "T-shirt": TopPattern(0.155, 0.010, 0.055, False, "band", 0.013, 0.0025),
    "V-neck T-shirt": TopPattern(0.145, 0.015, 0.110, True, "none", 0.012, 0.0025),
    "polo shirt": TopPattern(0.160, 0.005, 0.060, False, "polo", 0.013, 0.0025),
    "shirt": TopPattern(0.462, -0.010, 0.058, False, "shirt", 0.015, 0.0020),
    "jumper": TopPattern(0.470, 0.025, 0.050, False, "band", 0.019, 0.0050),
    "long-sleeved top": TopPattern(0.455, 0.015, 0.070, False, "band", 0.012, 0.0025),
}
_TOP_FABRICS: dict[str, tuple[str, ...]] = {
    "T-shirt": ("stripes", "plain", "print", "heather"),
    "V-neck T-shirt": ("plain", "stripes", "dots", "print"),
    "polo shirt": ("stripes", "plain"),
    "shirt": ("checks", "gingham", "denim", "dots", "stripes"),
    "jumper": ("knit",),
    "long-sleeved top": ("stripes", "heather", "print"),
}
_BOTTOMS: dict[str, TrouserPattern | SkirtPattern] = {
    "jeans": TrouserPattern(0.125, 0.812, 0.008, 0.015, 0.003),
    "slim trousers": TrouserPattern(0.130, 0.795, 0.007, 0.011, 0.003),
    "loose trousers": TrouserPattern(0.130, 0.812, 0.011, 0.026, 0.003),
    "shorts": TrouserPattern(0.125, 0.375, 0.011, 0.026, 0.003),
    "skirt": SkirtPattern(0.090, -0.380, 0.003, 0.003),
}
_BOTTOM_FABRICS: dict[str, tuple[str, ...]] = {
    "jeans": ("denim",),
    "slim trousers": ("plain",),
    "loose trousers": ("plain", "heather"),
    "shorts": ("plain", "denim"),
    "skirt": ("plain", "checks", "denim", "print"),
}
_MEN_WEAR = ("jeans", "slim trousers", "jeans", "loose trousers", "shorts", "loose trousers")
_WOMEN_WEAR = ("jeans", "slim trousers", "skirt", "jeans", "loose trousers", "skirt", "shorts")
_SHOES = ("trainers", "runners", "leather shoes")


@dataclass(frozen=True)
class Cloth:
    """A fabric to be woven: its kind and two dyes."""

    fabric: str
    base: str
    other: str


@dataclass(frozen=True)
class Outfit:
    """A plan of clothes; ``words`` describe them."""

    top: TopPattern
    top_cloth: Cloth
    bottom: TrouserPattern | SkirtPattern
    bottom_cloth: Cloth
    shoes: ShoePattern
    words: str
    actor: int


@dataclass(frozen=True)
class Dressed:
    """The pieces of an outfit, the skin they hide (over the base mesh's vertices), and where the shoes stand."""

    pieces: tuple[Piece, ...]
    hidden: Bool[np.ndarray, " P"]
    footing: Footing


def _pick(options: tuple[str, ...], rng: np.random.Generator) -> str:
    return options[int(rng.integers(len(options)))]


def _draw_shoes(kind: str, rng: np.random.Generator) -> ShoePattern:
    if kind == "leather shoes":
        upper = DYES[_pick(("brown", "charcoal"), rng)]
        return ShoePattern(
            "leather", 0.016, 2.4, 0.075, upper, (0.8 * upper[0], 0.8 * upper[1], 0.8 * upper[2]), DYES["charcoal"]
        )
    upper, accent = DYES[_pick(("white", "navy", "grey", "charcoal", "red"), rng)], DYES[_pick(_TOP_DYES, rng)]
    sole = DYES["white"] if kind == "trainers" else DYES[_pick(("white", "grey"), rng)]
    return ShoePattern("runner" if kind == "runners" else "canvas", 0.024, 2.2, 0.080, upper, accent, sole)


def draw_outfit(actor: int, female: bool, seed: StageSeed) -> Outfit:
    """Clothes of one actor; kinds of top and their colours take turns within a room."""
    room, rng = seed.stream("outfits"), seed.stream("outfit", actor)
    tops = tuple(_TOPS)
    top = tops[int(room.permutation(len(tops))[actor % len(tops)])]
    dye = _TOP_DYES[int(room.permutation(len(_TOP_DYES))[actor % len(_TOP_DYES)])]
    other = _pick(tuple(name for name in _TOP_DYES if name != dye), rng)
    top_cloth = Cloth(_pick(_TOP_FABRICS[top], rng), dye, other)
    legs = _pick(_WOMEN_WEAR if female else _MEN_WEAR, rng)
    leg_cloth = Cloth(_pick(_BOTTOM_FABRICS[legs], rng), "navy" if legs == "jeans" else _pick(_LEG_DYES, rng), "white")
    shoes = _pick(_SHOES, rng)
    below = f"a {leg_cloth.base} skirt" if legs == "skirt" else f"{leg_cloth.base} {legs}"
    words = f"a {dye} {top_cloth.fabric} {top}, {below} and {shoes}"
    words = words.replace("knit jumper", "knitted jumper").replace("print ", "printed ").replace("stripes ", "striped ")
    words = words.replace("checks ", "checked ").replace("dots ", "dotted ")
    return Outfit(_TOPS[top], top_cloth, _BOTTOMS[legs], leg_cloth, _draw_shoes(shoes, rng), words, actor)


def dress(wearer: Wearer, outfit: Outfit, seed: StageSeed) -> Dressed:
    """Makes the clothes of an outfit on a body."""
    rng = seed.stream("sewing", outfit.actor)
    cloths = [
        weave(cloth.fabric, DYES[cloth.base], DYES[cloth.other], rng)
        for cloth in (outfit.top_cloth, outfit.bottom_cloth)
    ]
    template_m, weights = base_mesh().vertices_m, base_weights()
    shoes, footing = make_shoes(wearer, outfit.shoes, rng)
    top = sew_top(wearer, outfit.top, cloths[0], rng)
    hidden = covered_by(top_field_m(outfit.top, template_m, weights))
    if isinstance(outfit.bottom, SkirtPattern):
        bottom = sew_skirt(wearer, outfit.bottom, outfit.top, cloths[1], rng)
        hidden |= covered_by(skirt_field_m(outfit.bottom, template_m, weights))
    else:
        bottom = sew_trousers(wearer, outfit.bottom, outfit.top, cloths[1], rng)
        hidden |= covered_by(trouser_field_m(outfit.bottom, template_m, weights))
    hidden |= shoe_field_m(outfit.shoes, template_m) > 0.02
    return Dressed((top, bottom, shoes), hidden, footing)
