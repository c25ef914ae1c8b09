"""MakeHuman's ``.mhmat`` materials, and opaque surfaces of textures with transparent parts."""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32, UInt8
from PIL import Image
from scipy import ndimage

from perpetua.actors.clothing.mhclo import broken, text_lines, within
from perpetua.errors import AssetError

_IMAGE_ENDINGS = (".png", ".jpg", ".jpeg", ".tif", ".tga", ".bmp")
_MOST_TEXELS = 8192 * 8192
_LARGEST_PX = 1024
# A texel counts as there from this much opacity on, a triangle from this fraction of such texels on.
_OPAQUE, _LEAST_FRACTION = 96, 0.4


@dataclass(frozen=True)
class Look:
    """A material: linear ``colour``, ``roughness``, and textures where the folder has them.

    ``there`` is true at texels that are not transparent; ``shade`` the ambient occlusion, 0 to 1.
    """

    name: str
    tags: tuple[str, ...]
    colour: tuple[float, float, float]
    roughness: float
    image: UInt8[np.ndarray, "H W 3"] | None
    there: Bool[np.ndarray, "H W"] | None
    shade: Float32[np.ndarray, "S S"] | None


@dataclass(frozen=True)
class MaterialFile:
    """What a ``.mhmat`` file says; textures that are not in the folder are None."""

    name: str
    tags: tuple[str, ...]
    colour: tuple[float, float, float]
    shininess: float
    opacity: float
    diffuse_path: Path | None
    occlusion_path: Path | None


def _texture(root: Path, path: Path, name: str, line: int) -> Path | None:
    """The texture of a name, or one that differs by its ending alone, as after conversion; None where there is none."""
    place = within(root, path, name, line)
    choices = [place, *(place.with_suffix(ending) for ending in _IMAGE_ENDINGS)]
    return next((choice for choice in choices if choice.is_file()), None)


def _numbers(path: Path, line: int, rest: str, count: int) -> list[float]:
    try:
        values = [float(word) for word in rest.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(0.0 <= value <= 1.0 for value in values):
        raise broken(path, line, f"there must be {count} numbers from 0 to 1", rest)
    return values


def read_material(path: Path, root: Path) -> MaterialFile:
    """Reads a ``.mhmat`` file of the asset folder ``root``.

    Raises:
        AssetError: the file breaks the format or names a file outside the folder.
    """
    name, tags, colour, numbers = path.stem, [], [1.0, 1.0, 1.0], {"shininess": 0.2, "opacity": 1.0}
    textures: dict[str, Path | None] = {}
    for line, word, rest in text_lines(path):
        if word == "name":
            name = rest
        elif word == "tag":
            tags.append(rest.lower())
        elif word == "diffuseColor":
            colour = _numbers(path, line, rest, 3)
        elif word in numbers:
            numbers[word] = _numbers(path, line, rest, 1)[0]
        elif word in ("diffuseTexture", "aomapTexture") and rest:
            textures[word] = _texture(root, path, rest, line)
        elif word in ("normalmapTexture", "bumpTexture", "specularmapTexture") and rest:
            within(root, path, rest, line)
    return MaterialFile(
        name, tuple(tags), (colour[0], colour[1], colour[2]), numbers["shininess"], numbers["opacity"],
        textures.get("diffuseTexture"), textures.get("aomapTexture"),
    )  # fmt: skip


def load_image(path: Path, mode: str) -> np.ndarray:
    """An image of at most 1,024 texels a side, in Pillow's ``mode``.

    Raises:
        AssetError: the file is not an image or has too many texels.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path) as opened:
                if opened.width * opened.height > _MOST_TEXELS:
                    raise AssetError(f"'{path}' must have at most {_MOST_TEXELS} texels, not {opened.size}: shrink it")
                picture = opened.convert(mode)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise AssetError(f"'{path}' must be an image that can be read: {error}") from None
    picture.thumbnail((_LARGEST_PX, _LARGEST_PX), Image.Resampling.LANCZOS)
    return np.asarray(picture)


def load_look(described: MaterialFile) -> Look:
    """The material with its textures; colour behind transparent texels is that of the nearest opaque one.

    Raises:
        AssetError: a texture is not an image that can be read.
    """
    image, there, shade = None, None, None
    if described.diffuse_path is not None:
        rgba = load_image(described.diffuse_path, "RGBA")
        image, opaque = np.ascontiguousarray(rgba[..., :3]), rgba[..., 3] >= _OPAQUE
        if not opaque.all() and opaque.any():
            there = opaque
            nearest = ndimage.distance_transform_edt(~opaque, return_distances=False, return_indices=True)
            image = image[tuple(nearest)]
    if described.occlusion_path is not None:
        shade = (load_image(described.occlusion_path, "L") / 255.0).astype(np.float32)
    return Look(described.name, described.tags, described.colour, 1.0 - 0.6 * described.shininess, image, there, shade)


def _opaque_fraction(there: Bool[np.ndarray, "H W"], uv: Float64[np.ndarray, "F 3 2"]) -> Float64[np.ndarray, " F"]:
    """Share of opaque texels in each triangle, by 36 samples spread over it."""
    steps = 8
    pairs = [(i, j) for i in range(steps) for j in range(steps - i)]
    first, second = (np.array([pair[axis] + 1.0 / 3.0 for pair in pairs]) / steps for axis in range(2))
    corner_weights = np.stack([1.0 - first - second, first, second], axis=1)
    place = np.einsum("sc,fcd->fsd", corner_weights, uv)
    height, width = there.shape
    column = np.floor(place[..., 0] * width).astype(np.int64) % width
    row = np.floor((1.0 - place[..., 1]) * height).astype(np.int64) % height
    return np.asarray(there[row, column].mean(axis=1))


@dataclass(frozen=True)
class Cut:
    """A mesh whose transparent parts are gone. ``from_old`` gives each vertex as a mix of two old ones.

    New vertices lie in the middle of old edges: vertex p is the mean of old vertices ``from_old[p]``.
    """

    faces: Int32[np.ndarray, "F 3"]
    uv: Float32[np.ndarray, "F 3 2"]
    from_old: Int32[np.ndarray, "P 2"]


def _quartered(faces: Int32[np.ndarray, "F 3"], uv: Float32[np.ndarray, "F 3 2"], count: int) -> Cut:
    """Each triangle as four, split at the middles of its edges."""
    edges = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    ends, place = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    middle = (count + place.reshape(-1, 3)).astype(np.int32)
    middle_uv = 0.5 * (uv + np.roll(uv, -1, axis=1))
    small, small_uv = [middle], [middle_uv]
    for turn in range(3):
        before = (turn + 2) % 3
        small.append(np.stack([faces[:, turn], middle[:, turn], middle[:, before]], axis=1))
        small_uv.append(np.stack([uv[:, turn], middle_uv[:, turn], middle_uv[:, before]], axis=1))
    old = np.repeat(np.arange(count, dtype=np.int32)[:, None], 2, axis=1)
    return Cut(
        np.concatenate(small).astype(np.int32),
        np.concatenate(small_uv).astype(np.float32),
        np.concatenate([old, ends.astype(np.int32)]),
    )


def without_transparent(
    faces: Int32[np.ndarray, "F 3"], uv: Float32[np.ndarray, "F 3 2"], count: int, there: Bool[np.ndarray, "H W"]
) -> Cut:
    """Leaves out what the texture makes transparent, as exact depth needs opaque surfaces.

    Triangles without an opaque texel go; those with some of both are split into four, of which the ones that are
    mostly transparent go. What stays is opaque.
    """
    fraction = _opaque_fraction(there, uv.astype(np.float64))
    mixed = (fraction > 0.0) & (fraction < 1.0)
    cut = _quartered(faces[mixed], uv[mixed], count)
    kept = _opaque_fraction(there, cut.uv.astype(np.float64)) >= _LEAST_FRACTION
    whole = fraction == 1.0
    return Cut(np.concatenate([faces[whole], cut.faces[kept]]), np.concatenate([uv[whole], cut.uv[kept]]), cut.from_old)
