"""What a person wears, drawn from the seed, and the pieces made of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import base_weights
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.clothing import garments
from perpetua.actors.clothing.fabrics import Fabric, weave
from perpetua.actors.clothing.garments import DYES
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

# How often what may go under a jacket does, and a woman wears a dress.
_JACKET_FRACTION, _DRESS_FRACTION = 0.6, 0.3
# How far socks reach above the floor under trousers, and with bare legs.
_LONG_SOCK_M, _SHORT_SOCK_M = 0.20, 0.125
# Socks lie on the skin: they hide it but for a rim this much narrower than that of other clothes.
_SOCK_GRIP_M = 0.020


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
            kind="leather",
            sole_m=0.016,
            toe=2.4,
            shaft_m=0.075,
            upper=upper,
            accent=(0.8 * upper[0], 0.8 * upper[1], 0.8 * upper[2]),
            sole=DYES["charcoal"],
        )
    upper, accent = DYES[_pick(("white", "navy", "grey", "charcoal", "red"), rng)], DYES[_pick(garments.TOP_DYES, rng)]
    sole = DYES["white"] if kind == "trainers" else DYES[_pick(("white", "grey"), rng)]
    return ShoePattern(
        kind="runner" if kind == "runners" else "canvas",
        sole_m=0.024,
        toe=2.2,
        shaft_m=0.080,
        upper=upper,
        accent=accent,
        sole=sole,
    )


@dataclass(frozen=True)
class _Suit:
    """What is worn on trunk and legs; ``top_words`` and ``leg_words`` describe it."""

    top: TopPattern
    top_cloth: Cloth
    bottom: TrouserPattern | SkirtPattern
    bottom_cloth: Cloth
    top_words: str
    leg_words: str = ""


def _draw_dress(dye: str, other: str, rng: np.random.Generator) -> _Suit:
    cloth = Cloth(_pick(garments.DRESS_FABRICS, rng), dye, other)
    bodice = garments.BODICES[int(rng.integers(len(garments.BODICES)))]
    return _Suit(bodice, cloth, garments.DRESS_SKIRT, cloth, f"a {dye} {cloth.fabric} dress")


def _draw_top_and_bottom(top: str, dye: str, other: str, female: bool, rng: np.random.Generator) -> _Suit:
    cloth = Cloth(_pick(garments.TOP_FABRICS[top], rng), dye, other)
    legs = _pick(garments.WOMEN_WEAR if female else garments.MEN_WEAR, rng)
    colour = "navy" if legs == "jeans" else _pick(garments.LEG_DYES, rng)
    leg_cloth = Cloth(_pick(garments.BOTTOM_FABRICS[legs], rng), colour, "white")
    leg_words = f", a {colour} skirt" if legs == "skirt" else f", {colour} {legs}"
    return _Suit(
        garments.TOPS[top], cloth, garments.BOTTOMS[legs], leg_cloth, f"a {dye} {cloth.fabric} {top}", leg_words
    )


def draw_outfit(actor: int, female: bool, seed: StageSeed) -> Outfit:
    """Clothes of one actor; kinds of top and their colours take turns within a room."""
    room, rng = seed.stream("outfits"), seed.stream("outfit", actor)
    top = _in_turn(tuple(garments.TOPS), actor, room)
    dye = _in_turn(garments.TOP_DYES, actor, room)
    other = _pick(tuple(name for name in garments.TOP_DYES if name != dye), rng)
    shoes = _pick(garments.SHOES, rng)
    jacket = _pick(tuple(garments.JACKETS), rng)
    jacket_cloth = Cloth(_pick(garments.JACKET_FABRICS[jacket], rng), _pick(garments.JACKET_DYES, rng), "beige")
    wears_jacket = top in garments.UNDER_JACKETS and rng.random() < _JACKET_FRACTION
    over = f" under a {jacket_cloth.base} {jacket_cloth.fabric} {jacket}" if wears_jacket else ""
    dressed = female and rng.random() < _DRESS_FRACTION
    suit = _draw_dress(dye, other, rng) if dressed else _draw_top_and_bottom(top, dye, other, female, rng)
    return Outfit(
        suit.top,
        suit.top_cloth,
        suit.bottom,
        suit.bottom_cloth,
        garments.JACKETS[jacket] if wears_jacket else None,
        jacket_cloth,
        _draw_shoes(shoes, rng),
        _sock_m(suit.bottom),
        Cloth("knit", _pick(garments.SOCK_DYES, rng), "grey"),
        _in_plain_words(f"{suit.top_words}{over}{suit.leg_words} and {shoes}"),
        actor,
    )


def _in_turn(options: tuple[str, ...], actor: int, room: np.random.Generator) -> str:
    """One of some options, in an order drawn for the room: actors differ for as long as there are others."""
    return options[int(room.permutation(len(options))[actor % len(options)])]


def _sock_m(bottom: TrouserPattern | SkirtPattern) -> float:
    if isinstance(bottom, SkirtPattern):
        return 0.0
    return _SHORT_SOCK_M if bottom is garments.BOTTOMS["shorts"] else _LONG_SOCK_M


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
