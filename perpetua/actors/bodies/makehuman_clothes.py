"""Dresses a body from a user's folder of MakeHuman assets: clothes, shoes, hair, eyebrows, hats and skins."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, UInt8
from PIL import Image

from perpetua.actors.base.base_mesh import VERTEX_COUNT, base_mesh
from perpetua.actors.base.images import to_srgb
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair import hair_image, make_hair
from perpetua.actors.bodies.makehuman_fit import cloth_image, load_looks, sewn
from perpetua.actors.bodies.makehuman_shoes import footing_of, levelled, under_hems, with_stiff_soles
from perpetua.actors.bodies.people import Person
from perpetua.actors.bodies.scalp import scalp_field_m
from perpetua.actors.bodies.skin import SKIN_PX, texel_places_m
from perpetua.actors.clothing.mhmat import Look, load_image
from perpetua.actors.clothing.outfit import Dressed
from perpetua.actors.clothing.shoes import make_shoes, shoe_field_m
from perpetua.actors.clothing.wardrobe import (
    Garment,
    Wardrobe,
    choose_clothes,
    choose_one,
    choose_skin,
    clothes_folder,
    load_wardrobe,
)
from perpetua.actors.config import ClothingConfig
from perpetua.seeding import StageSeed

# Hair under a hat ends so far above the hat's lowest edge.
_BRIM_M = 0.02


@dataclass(frozen=True)
class Worn:
    """A person's looks from the folder. ``dressed`` holds hair and eyebrows as well.

    ``skin`` is None where the folder has no skin for the person; ``hair`` is the linear colour of the hair.
    """

    dressed: Dressed
    skin: UInt8[np.ndarray, "S S 3"] | None
    hair: tuple[float, float, float]
    words: str


@dataclass(frozen=True)
class _Chosen:
    clothes: tuple[Garment, ...]
    shoes: Garment | None
    hair: Garment | None
    brows: Garment | None
    hat: Garment | None

    def worn(self) -> list[Garment]:
        """Everything that covers something, the lowest layer first."""
        some = [*self.clothes, *(garment for garment in (self.shoes, self.hat) if garment is not None)]
        return sorted(some, key=lambda garment: (garment.binding.depth, garment.binding.path.name))


def _choose(wardrobe: Wardrobe, person: Person, actor: int, hat_share: float, seed: StageSeed) -> _Chosen:
    female, room, rng = person.traits.female, seed.stream("wardrobe"), seed.stream("wardrobe", actor)
    hat = choose_one(wardrobe, "hat", female, actor, room)
    return _Chosen(
        choose_clothes(wardrobe, female, actor, room),
        choose_one(wardrobe, "shoes", female, actor, room),
        choose_one(wardrobe, "hair", female, actor, room),
        choose_one(wardrobe, "eyebrows", female, actor, room),
        hat if rng.random() < hat_share else None,
    )


def _linear_mean(look: Look | None) -> tuple[float, float, float] | None:
    """Mean colour of a texture's opaque texels, linear RGB (by the power 2.2, near enough for a tint)."""
    if look is None or look.image is None:
        return None
    texels = look.image[look.there] if look.there is not None else look.image.reshape(-1, 3)
    red, green, blue = ((texels / 255.0) ** 2.2).mean(axis=0)
    return float(red), float(green), float(blue)


def _under_hat(hair: Piece, hat: Piece) -> Piece:
    """The hair that shows below a hat."""
    brim_z_m = float(hat.vertices_m[:, 2].min()) + _BRIM_M
    part = hair.parts[0]
    below = hair.vertices_m[part.faces][..., 2].max(axis=1) < brim_z_m
    return replace(hair, parts=(replace(part, faces=part.faces[below], uv=part.uv[below]),))


def _skin_image(
    path_image: UInt8[np.ndarray, "H W 3"], person: Person, hair: tuple[float, float, float]
) -> UInt8[np.ndarray, "S S 3"]:
    """A skin texture with the scalp tinted in the hair's colour, so that no bare skin shines between strands."""
    image = np.asarray(Image.fromarray(path_image).resize((SKIN_PX, SKIN_PX)))
    cover = np.clip(scalp_field_m(texel_places_m(), person.hair.line_shift_m) / 0.02, 0.0, 0.9)[..., None]
    return np.round(image * (1.0 - cover) + to_srgb(np.array(hair)) * cover).astype(np.uint8)


def wear(wearer: Wearer, person: Person, actor: int, config: ClothingConfig, seed: StageSeed) -> Worn:
    """Dresses a body from the config's folder; shoes and hair that the folder lacks are made here.

    Raises:
        AssetError: the folder is missing, holds nothing that fits the person, or has a broken file.
    """
    wardrobe = load_wardrobe(clothes_folder(config.folder))
    chosen = _choose(wardrobe, person, actor, config.hat_share, seed)
    rng = seed.stream("cloth", actor)
    pieces, hidden = _layers(chosen, wearer, wardrobe, rng)
    if "shoes" in pieces:
        pieces["shoes"] = with_stiff_soles(levelled(pieces["shoes"]))
        footing = footing_of(pieces["shoes"])
    else:
        pieces["shoes"], footing = make_shoes(wearer, person.outfit.shoes, rng)
        hidden |= shoe_field_m(person.outfit.shoes, base_mesh().vertices_m) > 0.02
    hair_look = load_looks(chosen.hair, wardrobe) if chosen.hair is not None else None
    colour = _linear_mean(hair_look) or person.complexion.hair
    pieces["hair"] = _hair(chosen, wearer, person, hair_look, rng)
    if "hat" in pieces:
        pieces["hair"] = _under_hat(pieces["hair"], pieces["hat"])
    skin = choose_skin(wardrobe, person.traits.female, _ancestry(person), person.complexion.age, rng)
    image = None
    if skin is not None and skin.material.diffuse_path is not None:
        image = _skin_image(load_image(skin.material.diffuse_path, "RGB"), person, colour)
        if chosen.brows is not None:
            pieces["eyebrows"] = _brows(chosen.brows, wearer, wardrobe, colour, rng)
    shown = tuple(piece for piece in pieces.values() if len(piece.parts[0].faces) > 0)
    return Worn(Dressed(shown, hidden, footing), image, colour, _words(chosen, person))


def _layers(
    chosen: _Chosen, wearer: Wearer, wardrobe: Wardrobe, rng: np.random.Generator
) -> tuple[dict[str, Piece], Bool[np.ndarray, " B"]]:
    """Garments from the outermost layer inward, and the base vertices that they cover."""
    hidden = np.zeros(VERTEX_COUNT, dtype=bool)
    pieces: dict[str, Piece] = {}
    for garment in reversed(chosen.worn()):
        look = load_looks(garment, wardrobe)
        pieces[garment.kind] = sewn(garment, wearer, look, cloth_image(look, rng), hidden)
        hidden |= garment.binding.hides
    if chosen.shoes is not None:
        depth = chosen.shoes.binding.depth
        over = tuple(pieces[garment.kind] for garment in chosen.clothes if garment.binding.depth > depth)
        pieces["shoes"] = under_hems(pieces["shoes"], over)
    return pieces, hidden


def _hair(chosen: _Chosen, wearer: Wearer, person: Person, look: Look | None, rng: np.random.Generator) -> Piece:
    if chosen.hair is None:
        return make_hair(wearer, person.hair, person.complexion.hair, rng)
    image = look.image if look is not None and look.image is not None else hair_image(person.complexion.hair, rng)
    return sewn(chosen.hair, wearer, look, image, np.zeros(VERTEX_COUNT, dtype=bool))


def _brows(
    garment: Garment, wearer: Wearer, wardrobe: Wardrobe, colour: tuple[float, float, float], rng: np.random.Generator
) -> Piece:
    look = load_looks(garment, wardrobe)
    return sewn(garment, wearer, look, hair_image(colour, rng), np.zeros(VERTEX_COUNT, dtype=bool))


def _ancestry(person: Person) -> str:
    fractions = {name: getattr(person.traits, name) for name in ("african", "asian", "european")}
    return max(fractions, key=lambda name: fractions[name])


def _words(chosen: _Chosen, person: Person) -> str:
    hair = f"hair '{chosen.hair.binding.path.stem}'" if chosen.hair is not None else f"{person.hair.name} hair"
    names = [garment.binding.path.stem for garment in chosen.worn()]
    return f"{person.figure}, {hair}, wearing {', '.join(names)}"
