"""SMPL-X bodies from a licence holder's model files, in painted clothes or with BEDLAM2's textures."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, Int32, UInt8

from perpetua.actors.base.hands import relaxed_fingers
from perpetua.actors.base.images import tileable_noise, to_srgb
from perpetua.actors.bodies.bedlam import BedlamTextures, find_textures
from perpetua.actors.bodies.hair import hair_image
from perpetua.actors.bodies.people import draw_person
from perpetua.actors.bodies.skin import Complexion, eye_uv, paint_eye
from perpetua.actors.bodies.smplx_clothes import LABELS, Cut, CutSurface, cut_parts, wrapped_uv
from perpetua.actors.bodies.smplx_model import (
    SmplxModel,
    load_model,
    local_rotations,
    posed_m,
    rest_joints_m,
    shaped_m,
)
from perpetua.actors.bodies.source import Body
from perpetua.actors.clothing.fabrics import weave
from perpetua.actors.clothing.garments import DYES
from perpetua.actors.clothing.mhmat import load_image
from perpetua.actors.config import ActorsConfig, SmplxConfig
from perpetua.errors import AssetError
from perpetua.machine.assets import asset_folder
from perpetua.scene.actor import BODY_JOINTS, ActorPart, BodyMotion, Skeleton
from perpetua.scene.room import Material
from perpetua.seeding import StageSeed

_FILES = {True: "SMPLX_FEMALE.npz", False: "SMPLX_MALE.npz"}
_NEUTRAL = "SMPLX_NEUTRAL.npz"
_MOST_DEVIATIONS = 2.0
_TOP_DYES = ("teal", "red", "navy", "mustard", "green", "sky", "burgundy", "orange", "purple", "white")
_LEG_DYES = ("navy", "charcoal", "beige", "olive", "grey", "brown")
_SHOE_DYES = ("white", "charcoal", "brown", "grey")
_TOP_FABRICS = ("stripes", "checks", "heather", "knit", "dots", "denim")
# Sleeves and legs as fractions of arm and leg, and what they are called.
_TOPS = ((0.36, "T-shirt"), (0.93, "long-sleeved top"))
_LEGS = ((1.2, "trousers"), (0.52, "shorts"))
_SKIN_TILE_M, _BEDLAM_TILE_M, _HAIR_TILE_M = 0.35, 0.8, 0.25
_HEEL_FRACTION, _TOE_FRACTION = 0.05, 0.80
_FOOT_M = 0.05


@dataclass(frozen=True)
class SmplxBody:
    """A dressed SMPL-X body."""

    description: str
    skeleton: Skeleton
    parts: tuple[ActorPart, ...]
    _model: SmplxModel
    _vertices_m: Float64[np.ndarray, "10475 3"]
    _ends: Int32[np.ndarray, "P 2"]
    _fraction: Float32[np.ndarray, " P"]

    def pose(self, motion: BodyMotion) -> Float32[np.ndarray, "T P 3"]:
        """World positions in metres of all vertices at each frame of the motion."""
        local = local_rotations(motion, relaxed_fingers())
        posed = posed_m(self._model, self._vertices_m, local, motion.pelvis_m)
        first, second = posed[:, self._ends[:, 0]], posed[:, self._ends[:, 1]]
        return np.asarray(first + self._fraction[:, None] * (second - first))


@dataclass(frozen=True)
class _Clothes:
    cut: Cut
    top: tuple[str, str]
    leg_dye: str
    shoe_dye: str
    words: str


class SmplxBodies:
    """Draws SMPL-X shapes and dresses them."""

    def check(self, config: ActorsConfig) -> None:
        """Model files for men and women must be there, and the folder of textures if the config names one.

        Raises:
            AssetError: they are not.
        """
        for female in (False, True):
            model_file(config.smplx, female)
        find_textures(config.smplx.textures)

    def draw(self, actor: int, config: ActorsConfig, seed: StageSeed) -> Body:
        """The body of one actor of a room."""
        person, rng = draw_person(actor, config, seed), seed.stream("smplx", actor)
        female = person.traits.female
        model = load_model(model_file(config.smplx, female), config.smplx.betas)
        textures = find_textures(config.smplx.textures)
        betas = np.clip(rng.normal(0.0, 1.0, config.smplx.betas), -_MOST_DEVIATIONS, _MOST_DEVIATIONS)
        bare_m = shaped_m(model, betas)
        bare_m[:, 2] -= bare_m[:, 2].min()
        clothes = _draw_clothes(actor, seed, rng)
        surface, vertices_m = cut_parts(model, bare_m, rest_joints_m(model, bare_m), clothes.cut)
        looks = _Looks(model, person.complexion, female, clothes, textures, rng)
        ends, fraction, parts = _parts(model, surface, bare_m, looks)
        stature_cm = round(100.0 * float(np.ptp(bare_m[:, 2])))
        words = f"a {'woman' if female else 'man'}, {stature_cm} cm tall, wearing {clothes.words}"
        return SmplxBody(words, _skeleton(model, vertices_m), parts, model, vertices_m, ends, fraction)


def models_folder(config: SmplxConfig) -> Path:
    """The folder of model files: the one that the config names, else ``smplx`` in the asset folder."""
    return Path(config.folder).expanduser() if config.folder else asset_folder() / "smplx"


def model_file(config: SmplxConfig, female: bool) -> Path:
    """The file of the person's sex, else the neutral one.

    Raises:
        AssetError: neither is there.
    """
    folder = models_folder(config)
    for name in (_FILES[female], _NEUTRAL):
        if (folder / name).is_file():
            return folder / name
    raise AssetError(
        f"body model 'smplx' needs {_FILES[female]} or {_NEUTRAL} in '{folder}': get the files from "
        "https://smpl-x.is.tue.mpg.de (registration; not for commercial use) and set actors.smplx.folder"
    )


def _pick(options: tuple[str, ...], rng: np.random.Generator) -> str:
    return options[int(rng.integers(len(options)))]


def _draw_clothes(actor: int, seed: StageSeed, rng: np.random.Generator) -> _Clothes:
    """Colours of tops take turns within a room."""
    room = seed.stream("smplx clothes")
    dye = _TOP_DYES[int(room.permutation(len(_TOP_DYES))[actor % len(_TOP_DYES)])]
    sleeve, top = _TOPS[int(rng.integers(len(_TOPS)))]
    leg, legs = _LEGS[int(rng.integers(4)) == 0]
    fabric, leg_dye, shoe_dye = _pick(_TOP_FABRICS, rng), _pick(_LEG_DYES, rng), _pick(_SHOE_DYES, rng)
    words = f"a {dye} {top}, {leg_dye} {legs} and {shoe_dye} shoes"
    return _Clothes(Cut(sleeve, leg), (fabric, dye), leg_dye, shoe_dye, words)


@dataclass(frozen=True)
class _Looks:
    """Everything that materials are made from."""

    model: SmplxModel
    complexion: Complexion
    female: bool
    clothes: _Clothes
    textures: BedlamTextures | None
    rng: np.random.Generator

    def material(self, label: str) -> tuple[Material, float]:
        """A part's material, and the size of its repeat in metres; 0 where it follows the model's UVs."""
        if label == "body":
            return self._skin()
        if label.endswith("eye"):
            return Material("eyes", (0.7, 0.7, 0.7), roughness=0.15, image=paint_eye(self.complexion, self.rng)), 1.0
        if label == "hair":
            image = hair_image(self.complexion.hair, self.rng)
            return Material("hair", self.complexion.hair, roughness=0.6, image=image), _HAIR_TILE_M
        return self._cloth(label)

    def _skin(self) -> tuple[Material, float]:
        file = self.textures.draw_skin(self.female, self.rng) if self.textures is not None else None
        if file is None:
            return Material("skin", self.complexion.skin, roughness=0.55, image=self._painted_skin()), _SKIN_TILE_M
        if self.model.uv is None:
            raise AssetError(
                f"BEDLAM2's skins need texture coordinates, and SMPL-X model file '{self.model.path}' has none (arrays "
                "vt and ft): give a file with them, or leave bald/ out of actors.smplx.textures"
            )
        return Material("skin", self.complexion.skin, roughness=0.55, image=load_image(file, "RGB")), 0.0

    def _painted_skin(self) -> UInt8[np.ndarray, "S S 3"]:
        mottled = 1.0 + 0.05 * tileable_noise(self.rng, 512, 8, 3) + 0.05 * tileable_noise(self.rng, 512, 60, 2)
        return to_srgb(np.array(self.complexion.skin) * np.clip(mottled, 0.6, 1.4)[..., None])

    def _cloth(self, label: str) -> tuple[Material, float]:
        file = self.textures.draw_cloth(self.rng) if self.textures is not None and label != "shoes" else None
        if file is not None:
            return Material(label, (0.5, 0.5, 0.5), roughness=0.85, image=load_image(file, "RGB")), _BEDLAM_TILE_M
        kinds = {
            "top": self.clothes.top,
            "trousers": ("denim" if self.clothes.leg_dye == "navy" else "plain", self.clothes.leg_dye),
            "shoes": ("plain", self.clothes.shoe_dye),
        }
        fabric, dye = kinds[label]
        woven = weave(fabric, DYES[dye], DYES["cream"], self.rng)
        return Material(label, DYES[dye], roughness=woven.roughness, image=woven.image), woven.tile_m


def _parts(
    model: SmplxModel, surface: CutSurface, bare_m: Float64[np.ndarray, "10475 3"], looks: _Looks
) -> tuple[Int32[np.ndarray, "P 2"], Float32[np.ndarray, " P"], tuple[ActorPart, ...]]:
    """Parts with materials, and the places on the body of the vertices that they use."""
    corner_m = np.einsum("fcb,fbd->fcd", surface.corners, bare_m[model.faces[surface.source]])
    joint_m = rest_joints_m(model, bare_m)
    used, renumbered = np.unique(surface.faces, return_inverse=True)
    faces = renumbered.reshape(-1, 3).astype(np.int32)
    parts = []
    for index, label in enumerate(LABELS):
        chosen = surface.labels == index
        if not chosen.any():
            continue
        material, tile_m = looks.material(label)
        if label.endswith("eye"):
            uv = eye_uv(corner_m[chosen].reshape(-1, 3), corner_m[chosen])
        elif tile_m == 0.0 and model.uv is not None and model.uv_faces is not None:
            uv_corners = model.uv[model.uv_faces[surface.source[chosen]]]
            uv = np.einsum("fcb,fbd->fcd", surface.corners[chosen], uv_corners).astype(np.float32)
        else:
            uv = wrapped_uv(corner_m[chosen], joint_m, tile_m)
        parts.append(ActorPart(label, faces[chosen], uv, material))
    return surface.ends[used], surface.fraction[used], tuple(parts)


def _skeleton(model: SmplxModel, vertices_m: Float64[np.ndarray, "10475 3"]) -> Skeleton:
    """Joints with the pelvis over the origin, and heels and balls of the soles, which are on z = 0."""
    joint_m = rest_joints_m(model, vertices_m)[: len(BODY_JOINTS)]
    floor_m = float(vertices_m[:, 2].min())
    origin = np.array([joint_m[0, 0], joint_m[0, 1], floor_m])
    contacts = []
    for side in ("left", "right"):
        columns = [BODY_JOINTS.index(f"{side}_{name}") for name in ("ankle", "foot")]
        foot = vertices_m[model.weights[:, columns].sum(axis=1) > 0.5]
        low = foot[foot[:, 2] < floor_m + _FOOT_M]
        start, length = float(low[:, 0].min()), float(np.ptp(low[:, 0]))
        for fraction in (_HEEL_FRACTION, _TOE_FRACTION):
            near = low[np.abs(low[:, 0] - start - fraction * length) < 0.1 * length]
            contacts.append(np.array([start + fraction * length, near[:, 1].mean(), floor_m]))
    return Skeleton(joint_m - origin, np.stack(contacts) - origin)
