"""Dresses a body from a user's folder of MakeHuman assets: clothes, shoes, hair, eyebrows, hats and skins."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64, UInt8
from PIL import Image

from perpetua.actors.base.base_mesh import VERTEX_COUNT, base_mesh
from perpetua.actors.base.piece import Piece
from perpetua.actors.base.rig import base_weights, joint_index
from perpetua.actors.base.wearer import Wearer
from perpetua.actors.bodies.hair import hair_image, make_hair
from perpetua.actors.bodies.people import Person
from perpetua.actors.bodies.scalp import scalp_field_m
from perpetua.actors.bodies.skin import SKIN_PX, texel_places_m
from perpetua.actors.clothing.fabrics import tileable_noise, to_srgb
from perpetua.actors.clothing.garments import DYES
from perpetua.actors.clothing.mhclo import Binding, read_mesh
from perpetua.actors.clothing.mhmat import Look, load_image, load_look, read_material, without_transparent
from perpetua.actors.clothing.outfit import Dressed
from perpetua.actors.clothing.shoes import Footing, make_shoes, shoe_field_m
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
from perpetua.errors import AssetError
from perpetua.scene.actor import ActorPart
from perpetua.scene.room import Material
from perpetua.seeding import StageSeed

_DECIMETRE_M = 0.1
# Surfaces that are clearer than this are left out: exact depth needs opaque ones.
_CLEAR = 0.5
_WHITE = 0.95
# Of everything but hair, and of hair, whose strands are no mirror.
_LEAST_ROUGHNESS = (0.35, 0.62)
# The part of a shoe by whose length heel and ball are placed: heels of shoes may stand higher than soles.
_FOOT_M = 0.06
# How far along a shoe its heel and ball reach, and over which height the levelling of soles fades.
_NEAR_M, _STIFF_M, _FADE_M = 0.025, 0.04, 0.10
_LEVEL_PASSES = 4
_HEEL_FRACTION, _TOE_FRACTION = 0.04, 0.84
# Hair under a hat ends so far above the hat's lowest edge.
_BRIM_M = 0.02
# How far shoes and socks go on under the hems of trousers.
_HEM_M = 0.03
_CLOTH_DYES = ("navy", "charcoal", "olive", "burgundy", "teal", "beige", "grey", "sky", "green", "red")


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


def fitted(binding: Binding, vertices_m: Float64[np.ndarray, "B 3"]) -> Float64[np.ndarray, "P 3"]:
    """Where a garment's vertices lie on a shaped body in MakeHuman's rest pose.

    Args:
        binding: the garment's.
        vertices_m: all vertices of the base mesh, facing +X.
    """
    # MakeHuman's axes: X to the body's left, Y up, Z forward.
    base_dm = vertices_m[:, [1, 2, 0]] / _DECIMETRE_M
    place_dm = np.einsum("pc,pcd->pd", binding.corner_weights, base_dm[binding.base_vertices])
    for axis, scale in enumerate(binding.scales):
        unit = 1.0
        if scale is not None:
            unit = abs(float(base_dm[scale.first, axis] - base_dm[scale.second, axis])) / scale.reference_dm
        place_dm[:, axis] += unit * binding.offset_dm[:, axis]
    return np.ascontiguousarray(place_dm[:, [2, 0, 1]]) * _DECIMETRE_M


def bound_weights(binding: Binding) -> Float64[np.ndarray, "P J"]:
    """Skinning weights: those of the base vertices, in the proportions of the binding."""
    corner_weights = np.maximum(binding.corner_weights, 0.0)
    corner_weights /= np.maximum(corner_weights.sum(axis=1, keepdims=True), 1e-12)
    weights = np.einsum("pc,pcj->pj", corner_weights, base_weights()[binding.base_vertices])
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def load_looks(garment: Garment, wardrobe: Wardrobe) -> Look | None:
    """The garment's material; None where it names none or the named file is missing."""
    path = garment.binding.material_path
    if path is None or not path.is_file():
        return None
    described = read_material(path, wardrobe.folder)
    return load_look(described) if described.opacity >= _CLEAR else None


def _shaded(image: UInt8[np.ndarray, "H W 3"], look: Look) -> UInt8[np.ndarray, "H W 3"]:
    if look.shade is None:
        return image
    size = (image.shape[1], image.shape[0])
    shade = np.asarray(Image.fromarray(look.shade).resize(size))
    return np.round(image * shade[..., None]).clip(0, 255).astype(np.uint8)


def _cloth_image(look: Look | None, rng: np.random.Generator) -> UInt8[np.ndarray, "H W 3"]:
    """The garment's texture, or a plain woven cloth in its colour; white stands for any colour."""
    if look is not None and look.image is not None:
        return _shaded(look.image, look)
    dye = DYES[_CLOTH_DYES[int(rng.integers(len(_CLOTH_DYES)))]]
    colour = dye if look is None or min(look.colour) > _WHITE else look.colour
    grain = 1.0 + 0.10 * tileable_noise(rng, 512, 70, 2) + 0.06 * tileable_noise(rng, 512, 8, 3)
    plain = to_srgb(np.array(colour) * np.clip(grain, 0.5, 1.5)[..., None])
    return plain if look is None else _shaded(plain, look)


def _sewn(garment: Garment, wearer: Wearer, look: Look | None, image: np.ndarray, hidden: np.ndarray) -> Piece:
    """A garment on the body, without what others hide and what its texture makes transparent."""
    binding = garment.binding
    mesh = read_mesh(binding.mesh_path)
    if mesh.vertex_count != len(binding.corner_weights):
        raise AssetError(
            f"'{binding.path}' must bind as many vertices as '{binding.mesh_path.name}' has, {mesh.vertex_count}, not "
            f"{len(binding.corner_weights)}: mend the file or take it out of the folder"
        )
    vertices_m, weights = fitted(binding, wearer.vertices_m), bound_weights(binding)
    seen = ~np.all(hidden[binding.base_vertices], axis=1)[mesh.faces].all(axis=1)
    faces, uv = mesh.faces[seen], mesh.uv[seen]
    if look is not None and look.there is not None:
        cut = without_transparent(faces, uv, len(vertices_m), look.there)
        faces, uv = cut.faces, cut.uv
        vertices_m, weights = (values[cut.from_old].mean(axis=1) for values in (vertices_m, weights))
    roughness = max(look.roughness, _LEAST_ROUGHNESS[garment.kind == "hair"]) if look is not None else 0.8
    shade = Material(garment.kind, (0.5, 0.5, 0.5), roughness=roughness, image=image)
    return Piece(vertices_m, weights, (ActorPart(garment.kind, faces, uv, shade),))


def _with_stiff_soles(shoes: Piece) -> Piece:
    """Shoes whose low part follows ankles and toes alone, so that the soles stay flat whatever the shins do."""
    low = shoes.vertices_m[:, 2] < float(shoes.vertices_m[:, 2].min()) + _FOOT_M
    weights = shoes.weights.copy()
    for side, here in (("left", shoes.vertices_m[:, 1] > 0.0), ("right", shoes.vertices_m[:, 1] <= 0.0)):
        ankle, ball = joint_index(f"{side}_ankle"), joint_index(f"{side}_foot")
        toes = weights[low & here, ball]
        weights[low & here] = 0.0
        weights[low & here, ball], weights[low & here, ankle] = toes, 1.0 - toes
    return replace(shoes, weights=weights)


def _heel_and_toe_x_m(side_m: Float64[np.ndarray, "P 3"]) -> tuple[float, float]:
    """Where along one shoe its heel and its ball stand."""
    low = side_m[side_m[:, 2] < float(side_m[:, 2].min()) + _FOOT_M]
    start, length = float(low[:, 0].min()), float(np.ptp(low[:, 0]))
    return start + _HEEL_FRACTION * length, start + _TOE_FRACTION * length


def _levelled(shoes: Piece) -> Piece:
    """Shoes whose heels and balls reach the floor: MakeHuman's feet point a little down, and raise the heels."""
    vertices_m = shoes.vertices_m.copy()
    for here in (vertices_m[:, 1] > 0.0, vertices_m[:, 1] <= 0.0):
        for _ in range(_LEVEL_PASSES):
            side = vertices_m[here]
            places = _heel_and_toe_x_m(side)
            floor_m = float(side[:, 2].min())
            raised = [float(side[np.abs(side[:, 0] - x) < _NEAR_M, 2].min()) - floor_m for x in places]
            slope = (raised[1] - raised[0]) / (places[1] - places[0])
            above = np.clip(1.0 - (side[:, 2] - floor_m - _STIFF_M) / _FADE_M, 0.0, 1.0)
            vertices_m[here, 2] -= above * (raised[0] + slope * (side[:, 0] - places[0]))
        vertices_m[here, 2] -= float(vertices_m[here, 2].min()) - float(shoes.vertices_m[here, 2].min())
    return replace(shoes, vertices_m=vertices_m)


def _footing(shoes: Piece) -> Footing:
    """Heels and balls of a pair of shoes, in the middle of the soles."""
    floor_m = float(shoes.vertices_m[:, 2].min())
    heels: list[np.ndarray] = []
    toes: list[np.ndarray] = []
    for here in (shoes.vertices_m[:, 1] > 0.0, shoes.vertices_m[:, 1] <= 0.0):
        side = shoes.vertices_m[here]
        for found, x in zip((heels, toes), _heel_and_toe_x_m(side), strict=True):
            near = side[(np.abs(side[:, 0] - x) < _NEAR_M) & (side[:, 2] < floor_m + _STIFF_M)]
            found.append(np.array([x, near[:, 1].mean(), floor_m]))
    return Footing(np.stack(heels), np.stack(toes), floor_m)


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


def _under_hems(shoes: Piece, over: tuple[Piece, ...]) -> Piece:
    """Shoes without what of them, socks mostly, is high up in trousers: tight ones would let it through."""
    hem_z_m = min((float(piece.vertices_m[:, 2].min()) for piece in over), default=np.inf)
    part = shoes.parts[0]
    shown = shoes.vertices_m[part.faces][..., 2].min(axis=1) < hem_z_m + _HEM_M
    return replace(shoes, parts=(replace(part, faces=part.faces[shown], uv=part.uv[shown]),))


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
        pieces["shoes"] = _with_stiff_soles(_levelled(pieces["shoes"]))
        footing = _footing(pieces["shoes"])
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
        pieces[garment.kind] = _sewn(garment, wearer, look, _cloth_image(look, rng), hidden)
        hidden |= garment.binding.hides
    if chosen.shoes is not None:
        depth = chosen.shoes.binding.depth
        over = tuple(pieces[garment.kind] for garment in chosen.clothes if garment.binding.depth > depth)
        pieces["shoes"] = _under_hems(pieces["shoes"], over)
    return pieces, hidden


def _hair(chosen: _Chosen, wearer: Wearer, person: Person, look: Look | None, rng: np.random.Generator) -> Piece:
    if chosen.hair is None:
        return make_hair(wearer, person.hair, person.complexion.hair, rng)
    image = look.image if look is not None and look.image is not None else hair_image(person.complexion.hair, rng)
    return _sewn(chosen.hair, wearer, look, image, np.zeros(VERTEX_COUNT, dtype=bool))


def _brows(
    garment: Garment, wearer: Wearer, wardrobe: Wardrobe, colour: tuple[float, float, float], rng: np.random.Generator
) -> Piece:
    look = load_looks(garment, wardrobe)
    return _sewn(garment, wearer, look, hair_image(colour, rng), np.zeros(VERTEX_COUNT, dtype=bool))


def _ancestry(person: Person) -> str:
    fractions = {name: getattr(person.traits, name) for name in ("african", "asian", "european")}
    return max(fractions, key=lambda name: fractions[name])


def _words(chosen: _Chosen, person: Person) -> str:
    hair = f"hair '{chosen.hair.binding.path.stem}'" if chosen.hair is not None else f"{person.hair.name} hair"
    names = [garment.binding.path.stem for garment in chosen.worn()]
    return f"{person.figure}, {hair}, wearing {', '.join(names)}"
