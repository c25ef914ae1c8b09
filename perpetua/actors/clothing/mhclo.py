"""Readers of MakeHuman's asset files: ``.mhclo`` (how a garment is bound to the base mesh) and its ``.obj``.

Format: http://www.makehumancommunity.org/wiki/Documentation:MHCLO_format. Files are text and nothing in them is run.
"""

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Float64, Int32

from perpetua.actors.base.base_mesh import VERTEX_COUNT
from perpetua.errors import AssetError

_MOST_BYTES = 64 * 1024 * 1024
_BASE_MESH = "hm08"
_DEFAULT_DEPTH = 50
_SCALES = ("x_scale", "y_scale", "z_scale")
# One bound vertex, three with weights, or three with weights and an offset.
_BINDING_SIZES = (1, 6, 9)


@dataclass(frozen=True)
class AxisScale:
    """Offsets along an axis grow with the distance between two base vertices, in units of ``reference_dm``."""

    first: int
    second: int
    reference_dm: float


@dataclass(frozen=True)
class Binding:
    """A garment's vertices by three base vertices each: the weights of their places, and an offset in decimetres.

    ``scales`` are those of MakeHuman's X, Y and Z; None leaves offsets as they are. ``hides`` marks base vertices
    that the garment covers. Garments of higher ``depth`` lie over those of lower.
    """

    path: Path
    name: str
    tags: tuple[str, ...]
    base_vertices: Int32[np.ndarray, "P 3"]
    corner_weights: Float64[np.ndarray, "P 3"]
    offset_dm: Float64[np.ndarray, "P 3"]
    scales: tuple[AxisScale | None, AxisScale | None, AxisScale | None]
    hides: Bool[np.ndarray, " B"]
    depth: int
    mesh_path: Path
    material_path: Path | None


@dataclass(frozen=True)
class GarmentMesh:
    """Triangles of a garment, and texture coordinates of their corners."""

    vertex_count: int
    faces: Int32[np.ndarray, "F 3"]
    uv: Float32[np.ndarray, "F 3 2"]


def broken(path: Path, line: int, rule: str, value: str) -> AssetError:
    """The error for a line that breaks the format; lines count from 1."""
    return AssetError(f"'{path}', line {line}: {rule}, not '{value[:80]}': mend the file or take it out of the folder")


def within(root: Path, path: Path, name: str, line: int) -> Path:
    """The file that ``path`` names ``name``, beside it; it must lie in ``root``, links followed.

    Raises:
        AssetError: the name leads outside.
    """
    place = path.parent / name
    if not place.resolve().is_relative_to(root.resolve()):
        raise broken(path, line, f"a named file must lie in the asset folder '{root}'", name)
    return place


def text_lines(path: Path) -> Iterator[tuple[int, str, str]]:
    """Number, first word and rest of each line that is not empty and no comment.

    Authors' names may be in any encoding, so bytes that are not UTF-8 are replaced.

    Raises:
        AssetError: the file is missing or too large.
    """
    try:
        if path.stat().st_size > _MOST_BYTES:
            raise AssetError(f"'{path}' must be no larger than {_MOST_BYTES >> 20} MiB: take it out of the folder")
        content = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise AssetError(f"'{path}' must be a file that can be read: {error}") from None
    for number, line in enumerate(content.splitlines(), start=1):
        words = line.strip()
        if words and not words.startswith(("#", "//")):
            word, _, rest = words.partition(" ")
            yield number, word, rest.strip()


def _vertex(path: Path, line: int, word: str) -> int:
    if not word.isdecimal() or int(word) >= VERTEX_COUNT:
        raise broken(path, line, f"a vertex of the base mesh must be a whole number from 0 to {VERTEX_COUNT - 1}", word)
    return int(word)


def _number(path: Path, line: int, word: str) -> float:
    try:
        value = float(word)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise broken(path, line, "there must be a finite number", word)
    return value


def _bound_row(path: Path, line: int, words: list[str]) -> tuple[list[int], list[float], list[float]]:
    if len(words) not in _BINDING_SIZES:
        raise broken(path, line, "a bound vertex must have 1, 6 or 9 numbers", " ".join(words))
    if len(words) == 1:
        return [_vertex(path, line, words[0])] * 3, [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    numbers = [_number(path, line, word) for word in words[3:]]
    return [_vertex(path, line, word) for word in words[:3]], numbers[:3], numbers[3:] or [0.0, 0.0, 0.0]


def _axis_scale(path: Path, line: int, rest: str) -> AxisScale:
    words = rest.split()
    if len(words) != 3 or _number(path, line, words[2]) <= 0.0:
        raise broken(path, line, "a scale must be two base vertices and a distance above 0", rest)
    return AxisScale(_vertex(path, line, words[0]), _vertex(path, line, words[1]), _number(path, line, words[2]))


def _mark(path: Path, line: int, words: list[str], hides: Bool[np.ndarray, " B"]) -> None:
    """Marks vertices listed singly or as ranges ``first - last``."""
    place = 0
    while place < len(words):
        first = last = _vertex(path, line, words[place])
        if place + 2 < len(words) and words[place + 1] == "-":
            last = _vertex(path, line, words[place + 2])
            place += 2
        hides[first : last + 1] = True
        place += 1


def read_binding(path: Path, root: Path) -> Binding:
    """Reads a ``.mhclo`` file of the asset folder ``root``.

    Raises:
        AssetError: the file breaks the format, is for another base mesh, or names a file outside the folder.
    """
    rows: list[tuple[list[int], list[float], list[float]]] = []
    hides = np.zeros(VERTEX_COUNT, dtype=bool)
    scales: dict[str, AxisScale] = {}
    files: dict[str, Path] = {}
    name, tags, depth, section = path.stem, [], _DEFAULT_DEPTH, ""
    for line, word, rest in text_lines(path):
        if word in ("verts", "delete_verts", "weights"):
            section = word
        elif word[0].isdecimal():
            if section == "verts":
                rows.append(_bound_row(path, line, [word, *rest.split()]))
            elif section == "delete_verts":
                _mark(path, line, [word, *rest.split()], hides)
        elif word == "basemesh" and rest != _BASE_MESH:
            raise broken(path, line, f"garments must be made for the base mesh {_BASE_MESH}", rest)
        elif word in _SCALES:
            scales[word] = _axis_scale(path, line, rest)
        elif word == "z_depth":
            depth = round(_number(path, line, rest))
        elif word in ("obj_file", "material"):
            files[word] = within(root, path, rest, line)
        elif word == "name":
            name = rest
        elif word == "tag":
            tags.append(rest.lower())
    if not rows or "obj_file" not in files:
        raise AssetError(f"'{path}' must have a line obj_file and bound vertices after a line 'verts': mend the file")
    corners, weights, offsets = zip(*rows, strict=True)
    return Binding(
        path, name, tuple(tags), np.array(corners, dtype=np.int32), np.array(weights), np.array(offsets),
        (scales.get("x_scale"), scales.get("y_scale"), scales.get("z_scale")),
        hides, depth, files["obj_file"], files.get("material"),
    )  # fmt: skip


def _corner(path: Path, line: int, word: str, vertices: int, uvs: int) -> tuple[int, int]:
    """0-based vertex and texture coordinate of ``v``, ``v/vt`` or ``v/vt/vn``; texture -1 where there is none."""
    fields = word.split("/")
    valid = fields[0].isdecimal() and 1 <= int(fields[0]) <= vertices
    texture = fields[1] if len(fields) > 1 else ""
    if not valid or (texture and not (texture.isdecimal() and 1 <= int(texture) <= uvs)):
        raise broken(path, line, f"a corner must name one of {vertices} vertices and {uvs} texture coordinates", word)
    return int(fields[0]) - 1, int(texture) - 1 if texture else -1


def read_mesh(path: Path) -> GarmentMesh:
    """Reads the faces of a ``.obj`` file; faces of more than three corners become fans of triangles.

    Raises:
        AssetError: the file breaks the format.
    """
    vertices, uv, faces, uv_faces = 0, [[0.5, 0.5]], [], []
    for line, word, rest in text_lines(path):
        if word == "v":
            vertices += 1
        elif word == "vt":
            words = rest.split()
            if len(words) < 2:
                raise broken(path, line, "a texture coordinate must have two numbers", rest)
            uv.append([_number(path, line, words[0]), _number(path, line, words[1])])
        elif word == "f":
            corners = [_corner(path, line, corner, vertices, len(uv) - 1) for corner in rest.split()]
            for second, third in itertools.pairwise(corners[1:]):
                faces.append([corners[0][0], second[0], third[0]])
                # Texture coordinates count from 1 in this list: its first is for corners that have none.
                uv_faces.append([corners[0][1] + 1, second[1] + 1, third[1] + 1])
    if not faces:
        raise AssetError(f"'{path}' must have faces: mend the file or take it out of the folder")
    whole = np.array(faces, dtype=np.int32)
    flat = (whole[:, 0] == whole[:, 1]) | (whole[:, 1] == whole[:, 2]) | (whole[:, 0] == whole[:, 2])
    corner_uv = np.array(uv, dtype=np.float32)[np.array(uv_faces)]
    return GarmentMesh(vertices, whole[~flat], corner_uv[~flat])
