# SPDX-License-Identifier: GPL-3.0-or-later
"""What is baked of an open room: which meshes, their charts, and how dense the texels of each chart shall be."""

from dataclasses import dataclass

import bpy
import numpy as np

from blender_scripts.bake import atlas
from blender_scripts.bake.shader_channels import all_nodes

# Nodes that cost Cycles more than a look-up in an image.
PROCEDURAL = frozenset(
    {
        "TEX_NOISE",
        "TEX_VORONOI",
        "TEX_WAVE",
        "TEX_MAGIC",
        "TEX_BRICK",
        "TEX_CHECKER",
        "TEX_GRADIENT",
        "TEX_GABOR",
        "AMBIENT_OCCLUSION",
        "BEVEL",
    }
)
# Nodes whose value depends on the object or its place, so that the images of one object do not fit another.
PER_OBJECT = frozenset({"OBJECT_INFO", "NEW_GEOMETRY", "PARTICLE_INFO"})
LAMPS = frozenset({"EMISSION"})
# What a mesh that no ray met gets, as a share of the median of what was met.
UNSEEN_FRACTION = 0.25
# Finer than this share of a pixel of the closest views, texels show nothing more.
MOST_TEXELS_PER_PIXEL = 1.0
# What packing leaves of an image for charts, about.
PACKED_FRACTION = 0.87


@dataclass(frozen=True)
class Work:
    """One mesh to bake, on one of the objects that show it.

    ``texels_per_m`` f64[C] is the density of its charts; ``texels_per_pixel`` f64[C] how many texels a pixel of a
    typical view spans.
    """

    obj: bpy.types.Object
    slots: frozenset[int]
    charts: atlas.Charts
    texels_per_m: np.ndarray
    texels_per_pixel: np.ndarray

    @property
    def materials(self) -> list[bpy.types.Material]:
        """The materials that are baked."""
        return [self.obj.data.materials[slot] for slot in sorted(self.slots)]


def collect(closeness: dict[str, np.ndarray], max_texels: int) -> list[Work]:
    """The meshes with procedural materials, with densities that keep a budget of texels (per channel).

    ``closeness`` holds ``object_index``, ``triangle`` and ``pixels_per_m`` of what cameras met.
    """
    unseen_per_m = UNSEEN_FRACTION * float(np.median(closeness["pixels_per_m"])) if len(closeness["triangle"]) else 1.0
    plans = [(objs[0], slots, *_plan(objs, slots, closeness, unseen_per_m)) for objs, slots in _users()]
    plans = [plan for plan in plans if len(plan[2].size_m)]
    charts, close = [plan[2] for plan in plans], [plan[3].close for plan in plans]
    scale = atlas.shared_scale(charts, close, round(PACKED_FRACTION * max_texels), MOST_TEXELS_PER_PIXEL)
    return [
        Work(obj, slots, charts, scale * density.close, scale * density.close / density.typical)
        for obj, slots, charts, density in plans
    ]


def _users() -> list[tuple[list[bpy.types.Object], frozenset[int]]]:
    """The objects that show each mesh to be baked, and the slots of its procedural materials."""
    found: dict[str, tuple[list[bpy.types.Object], frozenset[int]]] = {}
    for obj in [obj for obj in bpy.context.scene.objects if obj.type == "MESH" and not obj.hide_render]:
        if obj.modifiers or any(slot.link == "OBJECT" for slot in obj.material_slots):
            continue
        slots = frozenset(k for k, material in enumerate(obj.data.materials) if _is_bakeable(material))
        if not slots:
            continue
        nodes = [node for k in slots for node in all_nodes(obj.data.materials[k].node_tree)]
        if obj.data.users > 1 and any(node.type in PER_OBJECT for node in nodes):
            obj.data = obj.data.copy()
        found.setdefault(obj.data.name_full, ([], slots))[0].append(obj)
    return list(found.values())


def _is_bakeable(material: bpy.types.Material | None) -> bool:
    if material is None or not material.use_nodes or material.node_tree.get_output_node("CYCLES") is None:
        return False
    nodes = all_nodes(material.node_tree)
    kinds = {node.type for node in nodes}
    return bool(kinds & PROCEDURAL) and not kinds & LAMPS and not any(map(_shines, nodes))


def _shines(node: bpy.types.Node) -> bool:
    """Whether a surface shader gives light of its own, as a screen does."""
    strength = node.inputs.get("Emission Strength") if node.type == "BSDF_PRINCIPLED" else None
    return strength is not None and (strength.is_linked or strength.default_value > 0.0)


def _plan(
    objs: list[bpy.types.Object], slots: frozenset[int], closeness: dict[str, np.ndarray], unseen_per_m: float
) -> tuple[atlas.Charts, atlas.Density]:
    """The charts of a mesh, and how finely they are seen."""
    obj = objs[0]
    mesh = obj.data
    faces, wanted = _read_faces(obj, slots)
    charts = atlas.make_charts(faces, wanted)
    chart_of_polygon = np.full(len(mesh.polygons), -1)
    chart_of_polygon[faces.face_of_corner] = charts.chart
    mesh.calc_loop_triangles()
    polygon = np.empty(len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("polygon_index", polygon)
    met = np.isin(closeness["object_index"], [other.pass_index for other in objs])
    met &= closeness["triangle"] < len(polygon)
    seen = atlas.Seen(polygon[closeness["triangle"][met]], closeness["pixels_per_m"][met])
    return charts, atlas.seen_density(charts, chart_of_polygon, seen, unseen_per_m)


def _read_faces(obj: bpy.types.Object, slots: frozenset[int]) -> tuple[atlas.Faces, np.ndarray]:
    """The faces of a mesh, in metres, and which of them bool[F] have one of these materials."""
    mesh = obj.data
    corners, count = len(mesh.loops), len(mesh.polygons)
    vertex, edge = np.empty(corners, np.int32), np.empty(corners, np.int32)
    mesh.loops.foreach_get("vertex_index", vertex)
    mesh.loops.foreach_get("edge_index", edge)
    total, slot = np.empty(count, np.int32), np.empty(count, np.int32)
    mesh.polygons.foreach_get("loop_total", total)
    mesh.polygons.foreach_get("material_index", slot)
    position, normal = np.empty(3 * len(mesh.vertices), np.float32), np.empty(3 * count, np.float32)
    mesh.vertices.foreach_get("co", position)
    mesh.polygons.foreach_get("normal", normal)
    scale = np.abs(np.array(obj.matrix_world.to_scale()))
    corner_m = position.reshape(-1, 3)[vertex].astype(np.float64) * scale
    faces = atlas.Faces(corner_m, np.repeat(np.arange(count), total), edge.astype(np.int64), normal.reshape(-1, 3))
    return faces, np.isin(np.minimum(slot, len(mesh.materials) - 1), sorted(slots))
