# SPDX-License-Identifier: GPL-3.0-or-later
"""Opens a stranger's .blend, glTF or OBJ file without running anything in it, and takes its surfaces and lamps out.

Nothing of the file survives but meshes, materials, images that lie in its folder or in the file itself, lamps and
the world: no text, driver, animation, compositor, sound or link to another file.
"""

from dataclasses import dataclass
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

from blender_scripts.scene_files.refusal import Refused
from blender_scripts.worker.opaque_materials import shader_trees
from blender_scripts.worker.plain_meshes import MAX_SUBDIVISION, cap_subdivision

SURFACES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
# These read files, or take time without bound.
FORBIDDEN_MODIFIERS = frozenset(
    {
        "CLOTH",
        "DYNAMIC_PAINT",
        "EXPLODE",
        "FLUID",
        "MESH_CACHE",
        "MESH_SEQUENCE_CACHE",
        "OCEAN",
        "PARTICLE_INSTANCE",
        "PARTICLE_SYSTEM",
        "SOFT_BODY",
    }
)
MAX_OBJECTS = 20_000
# A subdivided object keeps less than this; the room's own budget comes later.
MAX_SUBDIVIDED_TRIANGLES = 200_000
# glTF and OBJ have Y up; Blender's importer of glTF has turned it already.
Z_UP_FROM_Y_UP = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
NATURAL_UP = {"blend": "z", "glb": "y", "gltf": "y", "obj": "y"}
GREY = (0.4, 0.4, 0.4, 1.0)


@dataclass
class Piece:
    """One surface of the scene: its object, which has no modifiers, and the names around it, the nearest first."""

    obj: bpy.types.Object
    around: list[str]


def open_scene(path: Path, suffix: str) -> None:
    """Makes the file the current scene, with scripts off.

    Raises:
        Refused: Blender cannot read it, or it takes parts from other .blend files.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.context.preferences.filepaths.use_scripts_auto_execute = False
    try:
        if suffix == "blend":
            bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False)
        elif suffix == "obj":
            # Axes as they are in the file, and vertices too: a repair would hide that some are no numbers.
            bpy.ops.wm.obj_import(filepath=str(path), forward_axis="Y", up_axis="Z", validate_meshes=False)
        else:
            bpy.ops.import_scene.gltf(filepath=str(path), merge_vertices=False)
    except (RuntimeError, KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        reason = str(error).strip().splitlines()[-1] if str(error).strip() else type(error).__name__
        raise Refused("format", f"Blender cannot read it as .{suffix}: {reason}; export it again") from None
    if len(bpy.data.libraries):
        names = ", ".join(sorted(Path(library.filepath).name for library in bpy.data.libraries)[:3])
        raise Refused(
            "linked files",
            f"it takes parts from other .blend files ({names}): make them its own in Blender "
            "(Object > Relations > Make Local > All) and save it again",
        )
    _forget_code()


def _forget_code() -> None:
    """What could run, write or read later: texts, script nodes, compositors, sequencers, animation of shaders."""
    for obj in bpy.data.objects:
        for modifier in list(obj.modifiers):
            if modifier.type in FORBIDDEN_MODIFIERS:
                obj.modifiers.remove(modifier)
    for scene in bpy.data.scenes:
        scene.animation_data_clear()
        scene.sequence_editor_clear()
        if scene.node_tree is not None:
            scene.node_tree.nodes.clear()
        scene.use_nodes = False
        if hasattr(scene, "cycles"):
            scene.cycles.shading_system = False
    for holder in (*bpy.data.materials, *bpy.data.worlds, *bpy.data.lights):
        holder.animation_data_clear()
        if holder.node_tree is not None:
            for tree in shader_trees(holder.node_tree):
                tree.animation_data_clear()
                for node in [node for node in tree.nodes if node.type == "SCRIPT"]:
                    tree.nodes.remove(node)
    bpy.data.batch_remove(list(bpy.data.texts))


def take_surfaces(metres_per_unit: float, suffix: str, up_axis: str) -> tuple[list[Piece], list[bpy.types.Object]]:
    """Replaces the scene by plain objects in metres with Z up: surfaces, and lamps.

    Raises:
        Refused: there is nothing to see, too many objects, or vertices that are no numbers.
    """
    _show_what_is_rendered()
    placed = Matrix.Scale(metres_per_unit, 4) @ _upright(suffix, up_axis)
    pieces: list[Piece] = []
    lamps: list[bpy.types.Object] = []
    names: list[str] = []
    lamp_names: list[str] = []
    meshes: dict[tuple, bpy.types.Mesh] = {}
    depsgraph = bpy.context.evaluated_depsgraph_get()
    for instance in depsgraph.object_instances:
        obj, original = instance.object, instance.object.original
        if not instance.show_self or original.hide_render:
            continue
        if instance.is_instance and original.type != "MESH":
            # The mesh that Blender shows for a curve or text, beside the object itself; converting it crashes.
            continue
        matrix = placed @ instance.matrix_world
        if obj.type == "LIGHT":
            lamps.append(_new_object(original.name, original.data, matrix))
            lamp_names.append(original.name)
        elif obj.type in SURFACES:
            key = _sharing_key(obj, original)
            if key not in meshes:
                meshes[key] = _plain_mesh(obj, depsgraph)
            if len(meshes[key].polygons):
                instancer = instance.parent.original if instance.is_instance and instance.parent else None
                around = _names_around(original, instancer)
                pieces.append(Piece(_new_object(original.name, meshes[key], matrix), around))
                names.append(original.name)
        if len(pieces) > MAX_OBJECTS:
            raise Refused("objects", f"it has more than {MAX_OBJECTS} objects: join small ones, or take instances out")
    if not pieces:
        raise Refused("empty", "it holds nothing that has a surface and is rendered: export meshes")
    _keep_only([piece.obj for piece in pieces], lamps)
    # The file's own objects are gone, and their names free.
    for obj, name in zip([piece.obj for piece in pieces] + lamps, names + lamp_names, strict=True):
        obj.name = name
    _scale_lamps(lamps, metres_per_unit)
    return pieces, lamps


def _sharing_key(obj: bpy.types.Object, original: bpy.types.Object) -> tuple:
    """Equal for objects that have the same mesh once evaluated, as far as can be told."""
    if original.type == "MESH" and not original.modifiers and original.data.shape_keys is None:
        return (
            original.data.name_full,
            *(slot.material.name_full for slot in original.material_slots if slot.material),
        )
    return ("", original.name_full, 0 if obj.data is None else obj.data.as_pointer())


def _plain_mesh(obj: bpy.types.Object, depsgraph: bpy.types.Depsgraph) -> bpy.types.Mesh:
    mesh = bpy.data.meshes.new_from_object(obj, preserve_all_data_layers=True, depsgraph=depsgraph)
    places = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", places)
    broken = int((~np.isfinite(places.reshape(-1, 3)).all(1)).sum())
    if broken:
        raise Refused(
            "finite vertices",
            f"{broken} vertices of '{obj.name}' are no finite numbers: mend or delete them and export it again",
        )
    mesh.validate()
    return mesh


def _upright(suffix: str, up_axis: str) -> Matrix:
    natural = NATURAL_UP[suffix]
    wanted = natural if up_axis == "auto" else up_axis
    turned_already = suffix in {"glb", "gltf"}
    if wanted == "y":
        return Matrix.Identity(4) if turned_already else Z_UP_FROM_Y_UP
    return Z_UP_FROM_Y_UP.inverted() if turned_already else Matrix.Identity(4)


def _show_what_is_rendered() -> None:
    """Evaluation sees what the viewport shows; it shall be what a render shows."""
    for collection in bpy.data.collections:
        collection.hide_viewport = collection.hide_render
    waiting = [bpy.context.view_layer.layer_collection]
    while waiting:
        layer = waiting.pop()
        layer.hide_viewport = False
        waiting += list(layer.children)
    for obj in bpy.context.view_layer.objects:
        obj.hide_viewport = obj.hide_render
        obj.hide_set(False)
        if obj.type == "MESH":
            cap_subdivision(obj, MAX_SUBDIVISION, MAX_SUBDIVIDED_TRIANGLES)
    bpy.context.view_layer.update()


def _names_around(obj: bpy.types.Object, instancer: bpy.types.Object | None) -> list[str]:
    names = [] if obj.data is None else [obj.data.name]
    for start in filter(None, (obj, instancer)):
        parent = start.parent if start is obj else start
        while parent is not None:
            names.append(parent.name)
            parent = parent.parent
        names += [collection.name for collection in start.users_collection]
    return names


def _new_object(name: str, data: bpy.types.ID, matrix: Matrix) -> bpy.types.Object:
    obj = bpy.data.objects.new(name, data)
    obj.matrix_world = matrix
    whole = np.allclose(np.array(obj.matrix_basis), np.array(matrix), rtol=1e-4, atol=1e-5)
    if isinstance(data, bpy.types.Mesh) and not whole:
        # An object has no shear of its own: it goes into the mesh.
        obj.data = data.copy()
        obj.data.transform(matrix)
        obj.matrix_world = Matrix.Identity(4)
    return obj


def _keep_only(objs: list[bpy.types.Object], lamps: list[bpy.types.Object]) -> None:
    kept = {obj.name_full for obj in objs + lamps}
    bpy.data.batch_remove([obj for obj in bpy.data.objects if obj.name_full not in kept])
    scene = bpy.context.scene
    bpy.data.batch_remove([other for other in bpy.data.scenes if other != scene])
    bpy.data.batch_remove(list(bpy.data.collections))
    scene.camera = None
    for obj in objs + lamps:
        scene.collection.objects.link(obj)
    bpy.context.view_layer.update()


def _scale_lamps(lamps: list[bpy.types.Object], metres_per_unit: float) -> None:
    """A lamp's power spreads over an area: a scene that shrinks needs less of it. Sunlight has no distance."""
    for data in {lamp.data.name: lamp.data for lamp in lamps}.values():
        if data.type != "SUN":
            data.energy *= metres_per_unit**2
            for size in ("shadow_soft_size", "size", "size_y"):
                if hasattr(data, size):
                    setattr(data, size, getattr(data, size) * metres_per_unit)
    for lamp in lamps:
        # Scale does nothing to a lamp but to widen an area twice over.
        lamp.scale = (1.0, 1.0, 1.0)


def settle_images(root: Path) -> list[str]:
    """Packs the images that lie in a folder; makes others grey, and returns their names."""
    missing = []
    for image in list(bpy.data.images):
        if image.users == 0 or image.type != "IMAGE" or image.packed_file is not None:
            continue
        if image.source == "GENERATED":
            continue
        path = Path(bpy.path.abspath(image.filepath)).resolve()
        if image.source == "FILE" and path.is_relative_to(root) and path.is_file() and min(image.size) > 0:
            image.pack()
        else:
            missing.append(Path(image.filepath.replace("\\", "/")).name or image.name)
            _make_grey(image)
    return sorted(missing)


def _make_grey(image: bpy.types.Image) -> None:
    image.filepath = ""
    image.source = "GENERATED"
    image.generated_width = image.generated_height = 4
    image.generated_type = "BLANK"
    image.generated_color = GREY
