"""A user's folder of MakeHuman assets: what is in it, and what a person takes from it."""

import re
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from perpetua.actors.base.base_mesh import base_mesh
from perpetua.actors.clothing.mhclo import Binding, read_binding
from perpetua.actors.clothing.mhmat import MaterialFile, read_material
from perpetua.errors import AssetError
from perpetua.machine.assets import asset_folder, file_listing

# Heights on the base mesh by which garments are told apart: the chest, the thighs, the top of boots, the neck.
_CHEST_Z_M, _THIGH_Z_M, _BOOT_Z_M, _NECK_Z_M = (0.33, 0.43), (-0.25, -0.06), -0.45, 0.52
_ARM_Y_M = 0.26
_HATS = ("hat", "hats", "fedora", "cap", "beanie", "beret", "helmet")
_KINDS = ("suit", "top", "bottom", "shoes", "hat")
_SEXES = {True: ("female", "woman", "women", "girl"), False: ("male", "man", "men", "boy")}
_SKIN_YEARS = {"young": 28.0, "middleage": 48.0, "old": 68.0}


@dataclass(frozen=True)
class Garment:
    """Something to wear: its binding, its kind (suit, top, bottom, shoes, hat, hair, eyebrows), whom it suits."""

    kind: str
    binding: Binding
    female: bool | None


@dataclass(frozen=True)
class Skin:
    """A whole body's skin texture."""

    material: MaterialFile
    female: bool | None
    ancestry: str
    years: float


@dataclass(frozen=True)
class Wardrobe:
    """All that a folder holds, in the order of file names."""

    folder: Path
    garments: tuple[Garment, ...]
    skins: tuple[Skin, ...]

    def of(self, kind: str, female: bool) -> list[Garment]:
        """The garments of one kind that suit a person: those for the sex, else those for everybody."""
        suited = [garment for garment in self.garments if garment.kind == kind and garment.female is not (not female)]
        own = [garment for garment in suited if garment.female is female]
        return own or suited


def clothes_folder(folder: str) -> Path:
    """The folder of MakeHuman assets: the one that the config names, else ``makehuman`` in the asset folder."""
    return Path(folder).expanduser() if folder else asset_folder() / "makehuman"


def words_of(*texts: str) -> set[str]:
    """The lower-case words of names and tags: "male_suit02" has "male" and "suit"."""
    return set(re.findall(r"[a-z]+", " ".join(texts).lower()))


def _sex(words: set[str]) -> bool | None:
    for female, names in _SEXES.items():
        if words & set(names):
            return female
    return None


def _kind(binding: Binding) -> str | None:
    """What a garment is by where on the base mesh it is bound; None for what is neither clothing nor a hat."""
    place_m = base_mesh().vertices_m[np.unique(binding.base_vertices)]
    z_m = place_m[np.abs(place_m[:, 1]) < _ARM_Y_M, 2]
    if len(z_m) == 0:
        return None
    if z_m.max() < _BOOT_Z_M:
        return "shoes"
    if z_m.min() > _NECK_Z_M:
        return "hat" if words_of(binding.path.stem, binding.name, *binding.tags) & set(_HATS) else None
    chest = bool(np.any((z_m > _CHEST_Z_M[0]) & (z_m < _CHEST_Z_M[1])))
    thighs = bool(np.any((z_m > _THIGH_Z_M[0]) & (z_m < _THIGH_Z_M[1])))
    return {(True, True): "suit", (True, False): "top", (False, True): "bottom"}.get((chest, thighs))


def _garment(path: Path, root: Path) -> Garment | None:
    folder = path.relative_to(root).parts[0].lower()
    if folder not in ("clothes", "hair", "eyebrows"):
        return None
    binding = read_binding(path, root)
    kind = _kind(binding) if folder == "clothes" else folder
    return None if kind is None else Garment(kind, binding, _sex(words_of(path.stem, *binding.tags)))


def _skin(path: Path, root: Path) -> Skin | None:
    """A skin whose texture is there."""
    material = read_material(path, root)
    if material.diffuse_path is None:
        return None
    words = words_of(path.stem, *material.tags)
    ancestry = next((word for word in ("african", "asian") if word in words), "european")
    years = next((years for word, years in _SKIN_YEARS.items() if word in words), 40.0)
    return Skin(material, _sex(words), ancestry, years)


def load_wardrobe(folder: Path) -> Wardrobe:
    """Everything usable in the subfolders clothes, hair, eyebrows and skins of a folder.

    Raises:
        AssetError: there is no such folder, no garment in it, or a file is broken.
    """
    return _load(folder, tuple(file_listing(folder)))


@lru_cache(maxsize=2)
def _load(folder: Path, listing: tuple[str, ...]) -> Wardrobe:
    """``listing`` stands for the folder's content, so that changes are seen."""
    garments = [_garment(path, folder) for path in sorted(folder.glob("*/**/*.mhclo"))]
    skins = [_skin(path, folder) for path in sorted(folder.glob("skins/**/*.mhmat"))]
    found = tuple(garment for garment in garments if garment is not None)
    if not any(garment.kind in _KINDS for garment in found):
        raise AssetError(
            f"'{folder}' must hold MakeHuman garments (.mhclo files below 'clothes'), and there are none: point "
            "actors.clothing.folder to the folder that holds 'clothes'"
        )
    return Wardrobe(folder, found, tuple(skin for skin in skins if skin is not None))


def _turn(options: int, actor: int, rng: np.random.Generator) -> int:
    """Neighbours of a sex, who are every other actor, differ until all options are used up."""
    return int(rng.permutation(options)[(actor // 2) % options])


def choose_clothes(wardrobe: Wardrobe, female: bool, actor: int, room: np.random.Generator) -> tuple[Garment, ...]:
    """A suit, or a top with a bottom, each as likely as the folder has of them.

    Raises:
        AssetError: the folder has nothing that dresses a person of this sex.
    """
    outfits: list[tuple[Garment, ...]] = [(suit,) for suit in wardrobe.of("suit", female)]
    tops, bottoms = wardrobe.of("top", female), wardrobe.of("bottom", female)
    if bottoms:
        outfits += [(top, bottoms[place % len(bottoms)]) for place, top in enumerate(tops)]
    if not outfits:
        who = "women" if female else "men"
        raise AssetError(
            f"'{wardrobe.folder}' must hold a suit, or a top and a bottom, for {who}, and there is none: add one, or "
            "set actors.clothing.source to tailored"
        )
    return outfits[_turn(len(outfits), actor, room)]


def choose_one(wardrobe: Wardrobe, kind: str, female: bool, actor: int, room: np.random.Generator) -> Garment | None:
    """One garment of a kind; None where the folder has none for the person."""
    options = wardrobe.of(kind, female)
    return options[_turn(len(options), actor, room)] if options else None


def choose_skin(wardrobe: Wardrobe, female: bool, ancestry: str, years: float, rng: np.random.Generator) -> Skin | None:
    """A skin of the person's sex and ancestry that is nearest in age; None where the folder has none."""
    suited = [skin for skin in wardrobe.skins if skin.female is female and skin.ancestry == ancestry]
    if not suited:
        return None
    nearest = min(abs(skin.years - years) for skin in suited)
    options = [skin for skin in suited if abs(skin.years - years) == nearest]
    return options[int(rng.integers(len(options)))]
