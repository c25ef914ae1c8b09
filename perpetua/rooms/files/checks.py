"""Looks at a scene file before Blender opens it: is it what its name says, is it small enough, does it stay at home.

A file that anyone may have made is data to distrust. Nothing here decodes pictures or runs anything.
"""

import contextlib
import hashlib
import json
import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from perpetua.errors import InputError
from perpetua.io.files import file_sha256

SUFFIXES = (".blend", ".glb", ".gltf", ".obj")
MB = 1e6

# The first bytes of a .blend: plain, gzip (Blender 2) or Zstandard (since 3.0).
_BLEND_MAGIC = (b"BLENDER", b"\x1f\x8b", b"\x28\xb5\x2f\xfd")
_GLB_MAGIC, _GLB_JSON = 0x46546C67, 0x4E4F534A
_GLB_HEADER, _GLB_CHUNK = struct.Struct("<III"), struct.Struct("<II")
_SCHEME = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]*:")
_OBJ_LINE = re.compile(rb"^\s*(?:v|vn|vt|f|o|g|mtllib|usemtl|s|l|p)\s")
# An OBJ's head is long enough here to hold one line of it, behind comments.
_OBJ_HEAD_BYTES = 1 << 16
_TRIANGLES, _TRIANGLE_STRIP, _TRIANGLE_FAN = 4, 5, 6


class BadSceneFile(Exception):
    """The file cannot become a room; ``rule`` is a short name of what it breaks."""

    def __init__(self, rule: str, message: str) -> None:
        super().__init__(message)
        self.rule = rule


def find_scene_files(path: str | None) -> tuple[Path, ...]:
    """The scene files at a path: itself, or those of a folder, sorted by name.

    Raises:
        InputError: there is no such file, its suffix is none of ``SUFFIXES``, or the folder holds none.
    """
    if path is None:
        raise InputError("rooms.source 'file' needs a scene: set rooms.file.path to a file or a folder")
    given = Path(path)
    known = ", ".join(SUFFIXES)
    if given.is_dir():
        found = sorted(entry for entry in given.iterdir() if entry.suffix.lower() in SUFFIXES and entry.is_file())
        if not found:
            raise InputError(f"rooms.file.path must hold scenes ({known}); the folder '{given}' has none")
        return tuple(found)
    if not given.is_file():
        raise InputError(f"rooms.file.path must be a file or a folder, and '{given}' does not exist")
    if given.suffix.lower() not in SUFFIXES:
        raise InputError(f"rooms.file.path must end in {known}, not '{given.name}': export the scene as one of these")
    return (given,)


def scene_digests(path: str | None) -> dict[str, str]:
    """SHA-256 of each scene file at a path and of what it names directly (a .gltf's files, an .obj's materials).

    Files that cannot be read are left out: whoever makes the room says why.
    """
    try:
        scenes = find_scene_files(path)
    except InputError:
        return {}
    digests: dict[str, str] = {}
    for scene in scenes:
        with contextlib.suppress(OSError, BadSceneFile):
            status = scene.stat()
            digests[scene.name] = _digest_once(scene, status.st_size, status.st_mtime_ns)
    return digests


@lru_cache(maxsize=1024)
def _digest_once(scene: Path, size: int, changed_ns: int) -> str:
    together = hashlib.sha256()
    for file in (scene, *_referred(scene)):
        together.update(file_sha256(file).encode())
    return together.hexdigest()


def _referred(scene: Path) -> list[Path]:
    if scene.suffix.lower() == ".gltf":
        return [_inside(uri, scene) for uri in _uris(_parse_gltf(scene.read_bytes())) if not _is_data(uri)]
    if scene.suffix.lower() == ".obj":
        return [_inside(name, scene) for name in _read_obj(scene).libraries]
    return []


def check_scene_file(path: Path, max_file_mb: float, max_triangles: int) -> None:
    """Passes a file that Blender may open.

    Args:
        path: a scene file.
        max_file_mb: most megabytes of the file and what it refers to.
        max_triangles: most triangles it may announce.

    Raises:
        BadSceneFile: it is not what its name says, cut short, too large, or refers to files outside its folder.
    """
    check = {".blend": _check_blend, ".glb": _check_glb, ".gltf": _check_gltf, ".obj": _check_obj}
    try:
        _check_size([path], max_file_mb)
        check[path.suffix.lower()](path, max_file_mb, max_triangles)
    except OSError as error:
        raise BadSceneFile("unreadable", f"it cannot be read: {error}") from None


def _check_size(paths: list[Path], max_file_mb: float) -> None:
    size_mb = sum(path.stat().st_size for path in paths) / MB
    if size_mb > max_file_mb:
        what = "it has" if len(paths) == 1 else f"it and the {len(paths) - 1} files it refers to have"
        raise BadSceneFile(
            "size",
            f"{what} {size_mb:.1f} MB; rooms.file.max_file_mb is {max_file_mb:g}: raise it or simplify the scene",
        )


def _check_blend(path: Path, max_file_mb: float, max_triangles: int) -> None:
    with path.open("rb") as stream:
        start = stream.read(8)
    if not start.startswith(_BLEND_MAGIC):
        raise BadSceneFile("format", "it is no .blend file: save it with Blender")


def _check_glb(path: Path, max_file_mb: float, max_triangles: int) -> None:
    size = path.stat().st_size
    with path.open("rb") as stream:
        header = stream.read(_GLB_HEADER.size)
        if len(header) < _GLB_HEADER.size or _GLB_HEADER.unpack(header)[0] != _GLB_MAGIC:
            raise BadSceneFile("format", "it is no binary glTF file: export the scene again as .glb")
        _, version, length = _GLB_HEADER.unpack(header)
        if version != 2:
            raise BadSceneFile("format", f"it is glTF {version}, and only version 2 is read: export it again")
        chunk = stream.read(_GLB_CHUNK.size)
        if length > size or len(chunk) < _GLB_CHUNK.size or _GLB_CHUNK.unpack(chunk)[0] > size:
            raise BadSceneFile("truncated", f"it has {size} of {length} bytes: copy or export it again")
        json_length, kind = _GLB_CHUNK.unpack(chunk)
        if kind != _GLB_JSON:
            raise BadSceneFile("format", "its first chunk is not JSON: export the scene again as .glb")
        text = stream.read(json_length)
    _check_gltf_text(text, path, max_file_mb, max_triangles)


def _check_gltf(path: Path, max_file_mb: float, max_triangles: int) -> None:
    _check_gltf_text(path.read_bytes(), path, max_file_mb, max_triangles)


def _check_gltf_text(text: bytes, path: Path, max_file_mb: float, max_triangles: int) -> None:
    tree = _parse_gltf(text)
    referred = [_inside(uri, path) for uri in _uris(tree) if not _is_data(uri)]
    _check_size([path, *referred], max_file_mb)
    try:
        triangles = _gltf_triangles(tree)
    except (KeyError, IndexError, TypeError, AttributeError, ValueError):
        raise BadSceneFile("format", "its table of meshes is damaged: export the scene again") from None
    _check_triangles(triangles, max_triangles)


def _check_triangles(triangles: int, max_triangles: int) -> None:
    if triangles > max_triangles:
        raise BadSceneFile(
            "triangles",
            f"it has {triangles} triangles, and {max_triangles} are allowed: simplify it, or raise rooms.max_triangles",
        )


def _parse_gltf(text: bytes) -> dict[str, Any]:
    try:
        tree = json.loads(text)
    except (ValueError, RecursionError):
        raise BadSceneFile("format", "its JSON is damaged or cut short: export the scene again") from None
    if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
        raise BadSceneFile("format", "it is no glTF file (no 'asset'): export the scene again")
    return tree


def _is_data(uri: str) -> bool:
    return uri.startswith("data:")


def _uris(tree: Any) -> Iterator[str]:
    """Every "uri" anywhere, extensions included."""
    waiting = [tree]
    while waiting:
        branch = waiting.pop()
        if isinstance(branch, dict):
            if isinstance(branch.get("uri"), str):
                yield branch["uri"]
            waiting += branch.values()
        elif isinstance(branch, list):
            waiting += branch


def _inside(reference: str, scene: Path) -> Path:
    """The file beside the scene that a URI or path names.

    Raises:
        BadSceneFile: it leads out of the scene's folder, or is not there.
    """
    name = unquote(reference)
    shown = reference if len(reference) <= 80 else reference[:77] + "..."
    root = scene.parent.resolve()
    if _SCHEME.match(name) or name.startswith(("/", "\\")) or "\\" in name or "\0" in name:
        raise BadSceneFile("references", f"it refers to '{shown}', which is no file beside it: {_REMEDY}")
    path = (root / name).resolve()
    if not path.is_relative_to(root):
        raise BadSceneFile("references", f"it refers to '{shown}', which leads out of its folder: {_REMEDY}")
    if not path.is_file():
        raise BadSceneFile("references", f"it refers to '{shown}', which is not there: put it beside the scene")
    return path


_REMEDY = "export the scene with its files beside it, or as .glb, which holds all"


def _gltf_triangles(tree: dict[str, Any]) -> int:
    """Triangles of all meshes as often as nodes show them."""
    accessors, meshes = tree.get("accessors", []), tree.get("meshes", [])
    per_mesh = [sum(_primitive_triangles(part, accessors) for part in mesh["primitives"]) for mesh in meshes]
    return sum(per_mesh[node["mesh"]] for node in tree.get("nodes", []) if "mesh" in node)


def _primitive_triangles(primitive: dict[str, Any], accessors: list[dict[str, Any]]) -> int:
    index = primitive.get("indices", primitive["attributes"].get("POSITION"))
    corners = int(accessors[index]["count"]) if index is not None else 0
    mode = primitive.get("mode", _TRIANGLES)
    if mode == _TRIANGLES:
        return corners // 3
    return max(0, corners - 2) if mode in {_TRIANGLE_STRIP, _TRIANGLE_FAN} else 0


@dataclass(frozen=True)
class _ObjContent:
    triangles: int
    libraries: tuple[str, ...]


def _check_obj(path: Path, max_file_mb: float, max_triangles: int) -> None:
    content = _read_obj(path)
    _check_triangles(content.triangles, max_triangles)
    _check_size([path, *(_inside(name, path) for name in content.libraries)], max_file_mb)


def _read_obj(path: Path) -> _ObjContent:
    with path.open("rb") as stream:
        head = stream.read(_OBJ_HEAD_BYTES)
        if b"\0" in head or not any(_OBJ_LINE.match(line) for line in head.splitlines()):
            raise BadSceneFile("format", "it is no Wavefront OBJ file: export the scene again as .obj or .glb")
        stream.seek(0)
        triangles, libraries = 0, []
        for line in stream:
            words = line.split(None, 1)
            if line.startswith(b"f "):
                triangles += max(0, len(line.split()) - 3)
            elif len(words) == 2 and words[0] == b"mtllib":
                libraries.append(words[1].decode("utf-8", "replace").strip())
    return _ObjContent(triangles, tuple(libraries))
