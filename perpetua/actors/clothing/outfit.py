"""What a person wears, drawn from the seed, and the pieces made of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import base_weights
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.clothing.fabrics import Fabric, weave
from perpetua.actors.clothing.patterns import (
    SkirtPattern,
    TopPattern,
    TrouserPattern,
    covered_by,
    skirt_field_m,
    top_field_m,
    trouser_field_m,
)
from perpetua.actors.clothing.shoes import Footing, ShoePattern, make_shoes, shoe_field_m
from perpetua.actors.clothing.socks import make_socks, sock_field_m
from perpetua.actors.clothing.tailor import sew_skirt, sew_top, sew_trousers
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
    "T-shirt": TopPattern(0.160, 0.010, 0.055, False, "band", 0.013, 0.0025),
    "V-neck T-shirt": TopPattern(0.150, 0.015, 0.110, True, "none", 0.012, 0.0025),
    "polo shirt": TopPattern(0.165, 0.005, 0.060, False, "polo", 0.013, 0.0025, buttons_to_z_m=0.385),
    "shirt": TopPattern(0.462, -0.010, 0.058, False, "shirt", 0.015, 0.0020, 0.009, 0.0, 0.000, True),
    "jumper": TopPattern(0.470, 0.025, 0.050, False, "band", 0.019, 0.0050, 0.010),
    "long-sleeved top": TopPattern(0.455, 0.015, 0.070, False, "band", 0.012, 0.0025),
}
_JACKETS: dict[str, TopPattern] = {
    "jacket": TopPattern(0.470, -0.030, 0.075, False, "none", 0.024, 0.0060, 0.009, 0.040),
    "cardigan": TopPattern(0.468, -0.050, 0.150, True, "none", 0.022, 0.0050, 0.009, 0.028),
}
# What a jacket may be worn over, and how often one is.
_UNDER_JACKETS, _JACKET_FRACTION = ("T-shirt", "V-neck T-shirt"), 0.6
_JACKET_FABRICS = {"jacket": ("plain", "denim", "heather", "checks"), "cardigan": ("knit",)}
_JACKET_DYES = ("navy", "charcoal", "olive", "beige", "brown", "grey", "burgundy")
_BODICES = (
    TopPattern(0.110, 0.085, 0.075, False, "none", 0.007, 0.0025, 0.003),
    TopPattern(0.145, 0.085, 0.115, True, "none", 0.007, 0.0025, 0.003),
    TopPattern(0.400, 0.085, 0.060, False, "none", 0.007, 0.0025, 0.004),
)
_DRESS_SKIRT = SkirtPattern(0.125, -0.400, 0.004, 0.003)
_DRESS_FABRICS = ("print", "dots", "plain", "checks", "stripes")
_DRESS_FRACTION = 0.3
_TOP_FABRICS: dict[str, tuple[str, ...]] = {
    "T-shirt": ("stripes", "plain", "print", "heather"),
    "V-neck T-shirt": ("plain", "stripes", "dots", "print"),
    "polo shirt": ("stripes", "plain"),
    "shirt": ("checks", "gingham", "denim", "dots", "stripes"),
    "jumper": ("knit",),
    "long-sleeved top": ("stripes", "heather", "print"),
}
_BOTTOMS: dict[str, TrouserPattern | SkirtPattern] = {
    "jeans": TrouserPattern(0.125, 0.842, 0.009, 0.018, 0.003, 0.0055, True),
    "slim trousers": TrouserPattern(0.130, 0.836, 0.008, 0.014, 0.003, 0.0045, True),
    "loose trousers": TrouserPattern(0.130, 0.845, 0.012, 0.026, 0.003, 0.0075),
    "shorts": TrouserPattern(0.125, 0.375, 0.012, 0.028, 0.003, 0.006, True),
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
# How far socks reach above the floor under trousers, and with bare legs.
_LONG_SOCK_M, _SHORT_SOCK_M = 0.20, 0.125
# Socks lie on the skin: they hide it but for a rim this much narrower than that of other clothes.
_SOCK_GRIP_M = 0.020
_SOCK_DYES = ("white", "grey", "charcoal", "navy", "white")


@dataclass(frozen=True)
class Cloth:
    """A fabric to be woven: its kind and two dyes."""

    fabric: str
    base: str
    other: str


@dataclass(frozen=True)
class Outfit:
    """A plan of clothes; ``words`` describe them. ``sock_m`` is the height of socks, 0 for none."""

    top: TopPattern
    top_cloth: Cloth
    bottom: TrouserPattern | SkirtPattern
    bottom_cloth: Cloth
    jacket: TopPattern | None
    jacket_cloth: Cloth
    shoes: ShoePattern
    sock_m: float
    sock_cloth: Cloth
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
    shoes = _pick(_SHOES, rng)
    jacket = _pick(tuple(_JACKETS), rng)
    jacket_cloth = Cloth(_pick(_JACKET_FABRICS[jacket], rng), _pick(_JACKET_DYES, rng), "beige")
    lower: TrouserPattern | SkirtPattern
    wears_jacket = top in _UNDER_JACKETS and rng.random() < _JACKET_FRACTION
    over = f" under a {jacket_cloth.base} {jacket_cloth.fabric} {jacket}" if wears_jacket else ""
    if female and rng.random() < _DRESS_FRACTION:
        cloth = Cloth(_pick(_DRESS_FABRICS, rng), dye, other)
        bodice = _BODICES[int(rng.integers(len(_BODICES)))]
        upper, lower, lower_cloth = bodice, _DRESS_SKIRT, cloth
        words = f"a {dye} {cloth.fabric} dress{over}"
    else:
        cloth = Cloth(_pick(_TOP_FABRICS[top], rng), dye, other)
        legs = _pick(_WOMEN_WEAR if female else _MEN_WEAR, rng)
        colour = "navy" if legs == "jeans" else _pick(_LEG_DYES, rng)
        lower_cloth = Cloth(_pick(_BOTTOM_FABRICS[legs], rng), colour, "white")
        upper, lower = _TOPS[top], _BOTTOMS[legs]
        below = f"a {colour} skirt" if legs == "skirt" else f"{colour} {legs}"
        words = f"a {dye} {cloth.fabric} {top}{over}, {below}"
    bare = isinstance(lower, SkirtPattern)
    sock_m = 0.0 if bare else _SHORT_SOCK_M if lower is _BOTTOMS["shorts"] else _LONG_SOCK_M
    return Outfit(
        upper,
        cloth,
        lower,
        lower_cloth,
        _JACKETS[jacket] if wears_jacket else None,
        jacket_cloth,
        _draw_shoes(shoes, rng),
        sock_m,
        Cloth("knit", _pick(_SOCK_DYES, rng), "grey"),
        _in_plain_words(f"{words} and {shoes}"),
        actor,
    )


def _in_plain_words(words: str) -> str:
    """Kinds of cloth as one says them of clothes."""
    said = {"knit": "knitted", "print": "printed", "stripes": "striped", "checks": "checked", "dots": "dotted"}
    plain = " ".join(said.get(word, word) for word in words.split(" "))
    return plain.replace("a olive", "an olive").replace("a orange", "an orange")


def dress(wearer: Wearer, outfit: Outfit, seed: StageSeed) -> Dressed:
    """Makes the clothes of an outfit on a body."""
    rng = seed.stream("sewing", outfit.actor)
    top_fabric = _woven(outfit.top_cloth, rng)
    one_cloth = outfit.bottom_cloth == outfit.top_cloth
    bottom_fabric = top_fabric if one_cloth else _woven(outfit.bottom_cloth, rng)
    template_m, weights = base_mesh().vertices_m, base_weights()
    shoes, footing = make_shoes(wearer, outfit.shoes, rng)
    pieces = [sew_top(wearer, outfit.top, top_fabric, rng, outfit.jacket)]
    fields_m = [top_field_m(outfit.top, template_m, weights)]
    if isinstance(outfit.bottom, SkirtPattern):
        pieces.append(sew_skirt(wearer, outfit.bottom, outfit.top, bottom_fabric, rng))
        fields_m.append(skirt_field_m(outfit.bottom, template_m, weights))
    else:
        pieces.append(sew_trousers(wearer, outfit.bottom, outfit.top, bottom_fabric, rng))
        fields_m.append(trouser_field_m(outfit.bottom, template_m, weights))
    if outfit.jacket is not None:
        pieces.append(sew_top(wearer, outfit.jacket, _woven(outfit.jacket_cloth, rng), rng))
        fields_m.append(top_field_m(outfit.jacket, template_m, weights))
    if outfit.sock_m > 0.0:
        pieces.append(make_socks(wearer, outfit.sock_m, _woven(outfit.sock_cloth, rng)))
        fields_m.append(sock_field_m(outfit.sock_m, template_m) + _SOCK_GRIP_M)
    hidden = covered_by(tuple(fields_m))
    hidden |= shoe_field_m(outfit.shoes, template_m) > 0.02
    return Dressed((*pieces, shoes), hidden, footing)


def _woven(cloth: Cloth, rng: np.random.Generator) -> Fabric:
    return weave(cloth.fabric, DYES[cloth.base], DYES[cloth.other], rng)
