"""BEDLAM2's textures for SMPL-X bodies, from the folders that a licence holder unpacks.

Source: https://bedlam2.is.tue.mpg.de. Skins are ``bald/skin_*_ALB``, in SMPL-X's texture coordinates; clothing has
``gr_*/texture_*/*_diffuse`` and ``*_normal``. The garments' own meshes are Alembic files that go with one recorded
motion each: they are not read, and diffuse textures become the fabrics of clothes painted on the body.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from perpetua.actors.clothing.wardrobe import words_of
from perpetua.errors import AssetError
from perpetua.machine.assets import asset_folder

_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tga")
_FEMALE, _MALE = {"f", "female", "woman"}, {"m", "male", "man"}


@dataclass(frozen=True)
class BedlamTextures:
    """Texture files: skins of women and of men, and diffuse textures of clothes."""

    skins: dict[bool, tuple[Path, ...]]
    cloths: tuple[Path, ...]

    def draw_skin(self, female: bool, rng: np.random.Generator) -> Path | None:
        """A skin for a person; None where there is none."""
        return _pick(self.skins[female], rng)

    def draw_cloth(self, rng: np.random.Generator) -> Path | None:
        """A fabric; None where there is none."""
        return _pick(self.cloths, rng)


def _pick(paths: tuple[Path, ...], rng: np.random.Generator) -> Path | None:
    return paths[int(rng.integers(len(paths)))] if paths else None


def textures_folder(folder: str) -> Path:
    """The folder that the config names, else ``bedlam2`` in the asset folder."""
    return Path(folder).expanduser() if folder else asset_folder() / "bedlam2"


def _images(folder: Path, pattern: str) -> list[Path]:
    return [path for path in sorted(folder.rglob(pattern)) if path.suffix.lower() in _ENDINGS]


def find_textures(folder: str) -> BedlamTextures | None:
    """BEDLAM2's textures; None where no folder is named and the asset folder has none.

    Raises:
        AssetError: a folder is named, and it has no textures.
    """
    place = textures_folder(folder)
    if not folder and not place.is_dir():
        return None
    skins, cloths = _images(place, "bald/skin_*_ALB*"), _images(place, "gr_*/texture_*/*_diffuse*")
    if not skins and not cloths:
        alembic = next(iter(sorted(place.rglob("*.abc"))), None) if place.is_dir() else None
        remedy = "point actors.smplx.textures to the folder that holds them"
        if alembic is not None:
            remedy = (
                f"'{alembic.name}' is an Alembic garment, which goes with one recorded motion and cannot follow "
                f"another; {remedy}"
            )
        raise AssetError(f"'{place}' must hold bald/skin_*_ALB or gr_*/texture_*/*_diffuse images: {remedy}")
    return BedlamTextures(
        {
            female: tuple(path for path in skins if not words_of(path.stem) & other)
            for female, other in ((True, _MALE), (False, _FEMALE))
        },
        tuple(cloths),
    )
