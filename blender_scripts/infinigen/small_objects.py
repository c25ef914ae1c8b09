# SPDX-License-Identifier: GPL-3.0-or-later
"""Household objects for shelves and tops, in place of the abstract solids that Infinigen puts there.

Each maker draws its sizes and colours from the generator it is given and returns a mesh that stands on z = 0, named
after what it is. Materials are single colours: small objects show no more, and they render fast.
"""

import itertools
import math
from collections.abc import Callable
from typing import NamedTuple

import bmesh
import bpy
import numpy as np
import procfunc
from infinigen2.objects import bowl, plant_pot, vase
from mathutils import Matrix

from blender_scripts.worker.categories import category_of
from blender_scripts.worker.plain_meshes import thin_leaves, thin_out

Color = tuple[float, float, float]

# Linear RGB of dyes, glazes and paints.
COLORS: tuple[Color, ...] = (
    (0.55, 0.06, 0.05),
    (0.05, 0.13, 0.35),
    (0.06, 0.22, 0.12),
    (0.62, 0.36, 0.06),
    (0.75, 0.70, 0.60),
    (0.10, 0.09, 0.09),
    (0.28, 0.12, 0.06),
    (0.13, 0.33, 0.38),
    (0.42, 0.20, 0.32),
    (0.60, 0.60, 0.58),
    (0.65, 0.28, 0.14),
    (0.30, 0.36, 0.20),
)
PAPER: Color = (0.78, 0.73, 0.62)
WOOD: Color = (0.32, 0.17, 0.08)
WAX: Color = (0.82, 0.76, 0.64)
ROUND_SEGMENTS = 24
MAX_TRIANGLES = 4_000
SHARP_ANGLE_RAD = math.radians(35.0)


class SmallObject(NamedTuple):
    """What Infinigen's placement takes."""

    mesh: procfunc.MeshObject


Maker = Callable[[np.random.Generator], SmallObject]


def small_object_maker(kind: str) -> Maker:
    """A maker of objects that suit a kind of room, each of a few thousand triangles at most."""
    makers, weights = zip(*_SUITABLE[kind], strict=True)
    fractions = np.array(weights) / sum(weights)

    def make(rng: np.random.Generator, **_: object) -> SmallObject:
        made = makers[int(rng.choice(len(makers), p=fractions))](rng)
        obj = made.mesh.item()
        # Subdivision would come on top of what is dense already.
        obj.modifiers.clear()
        thin = thin_leaves if category_of(obj.name) == "plant" else thin_out
        thin([obj], [MAX_TRIANGLES])
        return made

    return make


def _on_circle(radius: float, height: float, k: int) -> tuple[float, float, float]:
    angle = 2.0 * math.pi * k / ROUND_SEGMENTS
    return radius * math.cos(angle), radius * math.sin(angle), height


class _Builder:
    """Collects boxes and turned solids of several colours into one object."""

    def __init__(self) -> None:
        self._mesh = bmesh.new()
        self._materials: list[bpy.types.Material] = []

    def color(self, color: Color, roughness: float, metallic: float = 0.0) -> int:
        """A material slot of one colour."""
        material = bpy.data.materials.new("small_thing")
        material.use_nodes = True
        surface = material.node_tree.nodes["Principled BSDF"]
        surface.inputs["Base Color"].default_value = (*color, 1.0)
        surface.inputs["Roughness"].default_value = roughness
        surface.inputs["Metallic"].default_value = metallic
        self._materials.append(material)
        return len(self._materials) - 1

    def box(self, size_m: tuple[float, float, float], placed: Matrix, slot: int, bevel_m: float = 0.0) -> None:
        """A box that stands on the origin of ``placed``."""
        size = Matrix.Diagonal((*size_m, 1.0))
        lift = Matrix.Translation((0.0, 0.0, 0.5 * size_m[2]))
        made = bmesh.ops.create_cube(self._mesh, size=1.0, matrix=placed @ lift @ size)["verts"]
        faces = {face for vertex in made for face in vertex.link_faces}
        for face in faces:
            face.material_index = slot
        if bevel_m > 0.0:
            edges = list({edge for face in faces for edge in face.edges})
            bmesh.ops.bevel(self._mesh, geom=edges, offset=bevel_m, segments=3, profile=0.5, affect="EDGES")

    def turned(self, profile_m: list[tuple[float, float]], slot: int) -> None:
        """A solid of revolution about z; ``profile_m`` is (radius, height) from the bottom to the top."""
        rings = [
            [self._mesh.verts.new(_on_circle(radius, height, k)) for k in range(ROUND_SEGMENTS)]
            for radius, height in profile_m
        ]
        for low, high in itertools.pairwise(rings):
            for k in range(ROUND_SEGMENTS):
                after = (k + 1) % ROUND_SEGMENTS
                self._mesh.faces.new((low[k], low[after], high[after], high[k])).material_index = slot
        self._mesh.faces.new(rings[0][::-1]).material_index = slot
        self._mesh.faces.new(rings[-1]).material_index = slot

    def finish(self, name: str) -> SmallObject:
        """The object, linked to the scene."""
        mesh = bpy.data.meshes.new(name)
        self._mesh.to_mesh(mesh)
        self._mesh.free()
        for material in self._materials:
            mesh.materials.append(material)
        mesh.polygons.foreach_set("use_smooth", np.ones(len(mesh.polygons), bool))
        mesh.set_sharp_from_angle(angle=SHARP_ANGLE_RAD)
        obj = bpy.data.objects.new(name, mesh)
        bpy.context.scene.collection.objects.link(obj)
        return SmallObject(procfunc.MeshObject(obj))


def _any_color(rng: np.random.Generator) -> Color:
    base = COLORS[int(rng.integers(len(COLORS)))]
    red, green, blue = np.clip(np.array(base) * rng.uniform(0.7, 1.3, size=3), 0.02, 0.85)
    return float(red), float(green), float(blue)


def _book(builder: _Builder, size_m: tuple[float, float, float], placed: Matrix, color: Color, paper: int) -> None:
    """Two covers and a spine around a block of pages; lies flat, spine at -x."""
    x_m, y_m, z_m = size_m
    cover_m = 0.003
    slot = builder.color(color, 0.5)
    for height_m in (0.0, z_m - cover_m):
        builder.box((x_m, y_m, cover_m), placed @ Matrix.Translation((0.0, 0.0, height_m)), slot)
    spine = Matrix.Translation((0.5 * (cover_m - x_m), 0.0, cover_m))
    builder.box((cover_m, y_m, z_m - 2.0 * cover_m), placed @ spine, slot)
    pages = Matrix.Translation((-0.001, 0.0, cover_m))
    builder.box((x_m - 0.008, y_m - 0.01, z_m - 2.0 * cover_m), placed @ pages, paper)


def _draw_book_m(rng: np.random.Generator) -> tuple[float, float, float]:
    height_m = float(rng.uniform(0.17, 0.26))
    return height_m * float(rng.uniform(0.66, 0.78)), height_m, float(rng.uniform(0.015, 0.045))


def _book_stack(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    paper = builder.color(PAPER, 0.9)
    z_m = 0.0
    for _ in range(int(rng.integers(1, 5))):
        size_m = _draw_book_m(rng)
        turn = Matrix.Rotation(float(rng.uniform(-0.2, 0.2)), 4, "Z")
        _book(builder, size_m, Matrix.Translation((0.0, 0.0, z_m)) @ turn, _any_color(rng), paper)
        z_m += size_m[2]
    return builder.finish("book_stack")


def _book_row(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    paper = builder.color(PAPER, 0.9)
    upright = Matrix(((0, 0, 1, 0), (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
    y_m = 0.0
    for _ in range(int(rng.integers(3, 8))):
        size_m = _draw_book_m(rng)
        place = Matrix.Translation((y_m, 0.0, 0.5 * size_m[1])) @ upright
        _book(builder, size_m, place, _any_color(rng), paper)
        y_m += size_m[2] + 0.001
    return builder.finish("book_row")


def _storage_box(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    x_m, y_m, z_m = (float(side_m) for side_m in rng.uniform((0.12, 0.16, 0.08), (0.22, 0.3, 0.18)))
    color = _any_color(rng)
    builder.box((x_m, y_m, z_m), Matrix.Identity(4), builder.color(color, 0.7), 0.003)
    lid = Matrix.Translation((0.0, 0.0, z_m - 0.02))
    lighter = (0.8 * color[0] + 0.1, 0.8 * color[1] + 0.1, 0.8 * color[2] + 0.1)
    builder.box((x_m + 0.008, y_m + 0.008, 0.028), lid, builder.color(lighter, 0.6), 0.003)
    return builder.finish("storage_box")


def _jar(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    radius_m, height_m = float(rng.uniform(0.035, 0.06)), float(rng.uniform(0.08, 0.17))
    body = builder.color(_any_color(rng), float(rng.uniform(0.08, 0.4)))
    shoulder_m = 0.85 * height_m
    builder.turned(
        [(0.9 * radius_m, 0.0), (radius_m, 0.006), (radius_m, shoulder_m - 0.01), (0.8 * radius_m, shoulder_m)], body
    )
    lid = builder.color(WOOD if rng.random() < 0.5 else COLORS[9], 0.5)
    builder.turned(
        [(0.86 * radius_m, shoulder_m), (0.86 * radius_m, height_m), (0.8 * radius_m, height_m + 0.004)], lid
    )
    return builder.finish("jar")


def _bottle(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    radius_m, height_m = float(rng.uniform(0.028, 0.042)), float(rng.uniform(0.16, 0.3))
    neck_m = float(rng.uniform(0.3, 0.42)) * radius_m
    profile = [(0.92, 0.0), (1.0, 0.02), (1.0, 0.52), (0.95, 0.6), (0.7, 0.68)]
    outline_m = [(fraction * radius_m, level * height_m) for fraction, level in profile]
    outline_m += [(neck_m, 0.76 * height_m), (neck_m, 0.93 * height_m)]
    builder.turned(outline_m, builder.color(_any_color(rng), float(rng.uniform(0.05, 0.25))))
    cap = builder.color(COLORS[5] if rng.random() < 0.5 else COLORS[9], 0.4)
    builder.turned([(1.15 * neck_m, 0.93 * height_m), (1.15 * neck_m, height_m)], cap)
    return builder.finish("bottle")


def _candle(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    radius_m, height_m = float(rng.uniform(0.02, 0.04)), float(rng.uniform(0.07, 0.18))
    dish = builder.color(COLORS[9], 0.3, metallic=1.0)
    builder.turned([(1.5 * radius_m, 0.0), (1.8 * radius_m, 0.012), (1.7 * radius_m, 0.014)], dish)
    wax = builder.color(WAX, 0.5)
    builder.turned([(radius_m, 0.014), (radius_m, height_m), (0.8 * radius_m, height_m + 0.004)], wax)
    wick = builder.color(COLORS[5], 0.9)
    builder.turned([(0.0015, height_m + 0.004), (0.0015, height_m + 0.014)], wick)
    return builder.finish("candle")


def _picture_frame(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    width_m, height_m = float(rng.uniform(0.1, 0.18)), float(rng.uniform(0.13, 0.24))
    lean = Matrix.Translation((0.0, 0.0, 0.004)) @ Matrix.Rotation(float(rng.uniform(0.15, 0.25)), 4, "Y")
    lean = lean @ Matrix.Rotation(math.pi, 4, "Z")
    layers = ((0.0, 1.0, _any_color(rng), 0.4), (0.006, 0.84, PAPER, 0.9), (0.0075, 0.62, _any_color(rng), 0.5))
    for depth_m, fraction, color, roughness in layers:
        lift = Matrix.Translation((-depth_m, 0.0, 0.5 * (1.0 - fraction) * height_m))
        size_m = (0.012, fraction * width_m, fraction * height_m)
        builder.box(size_m, lean @ lift, builder.color(color, roughness))
    return builder.finish("picture_frame")


def _towels(rng: np.random.Generator) -> SmallObject:
    builder = _Builder()
    x_m, y_m = float(rng.uniform(0.18, 0.24)), float(rng.uniform(0.26, 0.34))
    z_m = 0.0
    for _ in range(int(rng.integers(1, 4))):
        thickness_m = float(rng.uniform(0.03, 0.05))
        turn = Matrix.Rotation(float(rng.uniform(-0.05, 0.05)), 4, "Z")
        place = Matrix.Translation((0.0, 0.0, z_m)) @ turn
        builder.box((x_m, y_m, thickness_m), place, builder.color(_any_color(rng), 0.95), 0.4 * thickness_m)
        z_m += thickness_m
    return builder.finish("towels")


_LIVING: tuple[tuple[Maker, float], ...] = (
    (_book_stack, 3.0),
    (_book_row, 3.0),
    (_storage_box, 1.0),
    (_picture_frame, 1.0),
    (_candle, 1.0),
    (bowl.bowl_rand, 0.5),
    (vase.vase_rand, 1.0),
    (plant_pot.plant_pot_small_rand, 1.0),
)
_COOKING: tuple[tuple[Maker, float], ...] = (
    (_jar, 3.0),
    (_bottle, 2.0),
    (_storage_box, 0.7),
    (_book_stack, 0.4),
    (bowl.bowl_rand, 1.5),
    (vase.cup_rand, 2.0),
    (plant_pot.plant_pot_small_rand, 0.7),
)
_WASHING: tuple[tuple[Maker, float], ...] = (
    (_towels, 2.5),
    (_bottle, 2.5),
    (_jar, 2.0),
    (_candle, 1.0),
    (_storage_box, 1.0),
    (vase.cup_rand, 0.7),
    (plant_pot.plant_pot_small_rand, 0.7),
)
_SUITABLE = {
    "bathroom": _WASHING,
    "bedroom": _LIVING,
    "diningroom": (*_LIVING, (_jar, 1.0), (_bottle, 1.0), (vase.cup_rand, 1.5)),
    "kitchen": _COOKING,
    "livingroom": _LIVING,
}
