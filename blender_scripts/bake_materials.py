# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes a room's procedural materials to image textures, once per room.

    python bake_materials.py bake.json

The job holds ``blend_path``, ``out_path`` (a .blend that appears by rename when all is done) and ``max_texels``.
Each mesh gets UVs of its own and up to three images: colour; roughness, metalness and translucency; and the normal
with all bumps, in object space. Objects that share a mesh share its images. Materials without procedural textures
and lamps keep their shaders. Events: ``baked`` for each mesh, ``done``.
"""

import sys
import time
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import atlas
import bpy
import numpy as np
from baked_materials import BAKED_UV, build_baked_material
from shader_channels import COLOR, SURFACE, ChannelReader, all_nodes
from worker_link import Worker, read_job

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
# Small things are looked at from closer by: their texels are denser.
SMALL_M2, SMALL_BOOST = 0.5, 1.5
MARGIN_PX = 3
# What packing leaves of an image for charts, about.
PACKED_SHARE = 0.87


@dataclass(frozen=True)
class Work:
    """One mesh to bake, on one of the objects that show it."""

    thing: bpy.types.Object
    slots: frozenset[int]
    charts: atlas.Charts
    boost: float


class Baker:
    """Bakes the meshes of the open file."""

    def __init__(self) -> None:
        self._reader = ChannelReader()
        self._rewired: dict[str, dict[str, bpy.types.Node]] = {}
        self._blank = bpy.data.materials.new("blank")
        self._blank.use_nodes = True

    def bake(self, work: Work, texels_per_m: float) -> int:
        """Bakes one mesh and gives it its new material; returns its texels."""
        mesh = work.thing.data
        packing = atlas.pack(work.charts, texels_per_m * work.boost)
        layer = mesh.uv_layers.new(name=BAKED_UV, do_init=False)
        layer.uv.foreach_set("vector", atlas.uv(work.charts, packing, texels_per_m * work.boost).ravel())
        originals = list(mesh.materials)
        chosen = [originals[slot] for slot in sorted(work.slots)]
        for material in chosen:
            self._rewire(material)
        for slot in range(len(originals)):
            if slot not in work.slots:
                mesh.materials[slot] = self._blank
        images = {COLOR: self._bake_channel(work, COLOR, chosen, packing)}
        images[SURFACE] = self._bake_channel(work, SURFACE, chosen, packing)
        if any("bump" in self._rewired[material.name_full] for material in chosen):
            images["normal"] = self._bake_channel(work, "bump", chosen, packing)
        baked = build_baked_material(mesh.name, images)
        for slot, original in enumerate(originals):
            mesh.materials[slot] = baked if slot in work.slots else original
        return packing.width_px * packing.height_px

    def _rewire(self, material: bpy.types.Material) -> None:
        """Gives a material an emission shader for each channel, once."""
        if material.name_full in self._rewired:
            return
        tree = material.node_tree
        output = tree.get_output_node("CYCLES")
        shaders: dict[str, bpy.types.Node] = {}
        for channel in (COLOR, SURFACE):
            value = self._reader.channel(tree, output.inputs["Surface"], channel)
            shaders[channel] = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(value, shaders[channel].inputs["Color"])
        if output.inputs["Displacement"].is_linked:
            shaders["bump"] = tree.nodes.new("ShaderNodeBsdfDiffuse")
            shaders["displacement"] = output.inputs["Displacement"].links[0].from_node
        self._rewired[material.name_full] = shaders

    def _bake_channel(
        self, work: Work, channel: str, materials: list[bpy.types.Material], packing: atlas.Packing
    ) -> bpy.types.Image:
        """One image of one mesh."""
        normal = channel == "bump"
        image = bpy.data.images.new(
            f"{work.thing.data.name}_{channel}", packing.width_px, packing.height_px, float_buffer=normal
        )
        image.colorspace_settings.name = "sRGB" if channel == COLOR else "Non-Color"
        for material in [*materials, self._blank]:
            self._aim(material, channel, image)
        bpy.ops.object.bake(
            type="NORMAL" if normal else "EMIT",
            normal_space="OBJECT",
            margin=MARGIN_PX,
            margin_type="EXTEND",
            use_clear=False,
            target="IMAGE_TEXTURES",
            uv_layer=BAKED_UV,
        )
        if normal:
            soften(image)
        image.pack()
        return image

    def _aim(self, material: bpy.types.Material, channel: str, image: bpy.types.Image) -> None:
        """Makes a material show one channel and the bake go into ``image``."""
        tree = material.node_tree
        target = tree.nodes.get("bake_target")
        if target is None:
            target = tree.nodes.new("ShaderNodeTexImage")
            target.name = "bake_target"
        target.image = image
        tree.nodes.active = target
        shaders = self._rewired.get(material.name_full)
        if shaders is None:
            return
        output = tree.get_output_node("CYCLES")
        shader = shaders.get(channel)
        if shader is None:
            # No bump of its own beside materials that have one.
            shader = shaders[COLOR]
        tree.links.new(shader.outputs[0], output.inputs["Surface"])
        displacement = output.inputs["Displacement"]
        if channel == "bump" and "displacement" in shaders:
            return
        for link in list(displacement.links):
            tree.links.remove(link)


def soften(image: bpy.types.Image) -> None:
    """Averages baked normals over neighbouring texels.

    A normal is baked at one point of a texel. Where bumps are finer than texels, that is noise, which would turn a
    polished floor into sandpaper; rendering the bumps themselves averages over a pixel likewise.
    """
    width, height = image.size
    pixels = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    baked = (pixels[..., :3] != 0.0).any(axis=-1)
    pixels[..., :3] = np.where(baked[..., None], atlas.blur(pixels[..., :3], baked), pixels[..., :3])
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def collect() -> list[Work]:
    """The meshes with procedural materials, one object for each."""
    found: dict[str, Work] = {}
    for thing in [thing for thing in bpy.context.scene.objects if thing.type == "MESH" and not thing.hide_render]:
        if thing.modifiers or any(slot.link == "OBJECT" for slot in thing.material_slots):
            continue
        slots = frozenset(k for k, material in enumerate(thing.data.materials) if _is_bakeable(material))
        if not slots:
            continue
        nodes = [node for k in slots for node in all_nodes(thing.data.materials[k].node_tree)]
        if thing.data.users > 1 and any(node.type in PER_OBJECT for node in nodes):
            thing.data = thing.data.copy()
        if thing.data.name_full not in found:
            found[thing.data.name_full] = _plan(thing, slots)
    return [work for work in found.values() if len(work.charts.size_m)]


def _is_bakeable(material: bpy.types.Material | None) -> bool:
    if material is None or not material.use_nodes or material.node_tree.get_output_node("CYCLES") is None:
        return False
    kinds = {node.type for node in all_nodes(material.node_tree)}
    return bool(kinds & PROCEDURAL) and not kinds & LAMPS


def _plan(thing: bpy.types.Object, slots: frozenset[int]) -> Work:
    mesh = thing.data
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
    area = np.empty(count, np.float32)
    mesh.polygons.foreach_get("area", area)
    scale = np.abs(np.array(thing.matrix_world.to_scale()))
    corner_m = position.reshape(-1, 3)[vertex].astype(np.float64) * scale
    faces = atlas.Faces(corner_m, np.repeat(np.arange(count), total), edge.astype(np.int64), normal.reshape(-1, 3))
    wanted = np.isin(np.minimum(slot, len(mesh.materials) - 1), sorted(slots))
    area_m2 = float(area[wanted].sum()) * float(np.prod(scale)) ** (2.0 / 3.0)
    return Work(thing, slots, atlas.make_charts(faces, wanted), SMALL_BOOST if area_m2 < SMALL_M2 else 1.0)


def isolate(things: list[bpy.types.Object]) -> dict[bpy.types.Object, bool]:
    """Hides everything from Cycles, so that a bake loads one object; returns what was hidden before."""
    hidden = {thing: thing.hide_render for thing in things}
    for thing in things:
        thing.hide_render = True
        thing.select_set(False)
    return hidden


def configure() -> None:
    """One sample per texel, on the CPU."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = False
    scene.cycles.device = "CPU"
    scene.cycles.samples = 1
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = False


def bake_all(worker: Worker, max_texels: int) -> None:
    """Bakes the open file's meshes within a budget of texels (per channel)."""
    works = collect()
    if not works:
        return
    budget = round(PACKED_SHARE * max_texels)
    texels_per_m = atlas.shared_density([work.charts for work in works], [work.boost for work in works], budget)
    scene = bpy.context.scene
    world, scene.world = scene.world, None
    hidden = isolate(list(scene.objects))
    baker = Baker()
    for work in works:
        worker.check_parent()
        started = time.monotonic()
        work.thing.hide_render = False
        work.thing.select_set(True)
        bpy.context.view_layer.objects.active = work.thing
        used = baker.bake(work, texels_per_m)
        work.thing.select_set(False)
        work.thing.hide_render = True
        worker.emit(
            "baked",
            mesh=work.thing.name,
            texels=used,
            charts=len(work.charts.size_m),
            seconds=time.monotonic() - started,
        )
    for thing, was_hidden in hidden.items():
        thing.hide_render = was_hidden
    scene.world = world


def main() -> None:
    """Bakes what the job names."""
    worker = Worker()
    job = read_job(worker.job_path())
    bpy.ops.wm.open_mainfile(filepath=job["blend_path"], load_ui=False, use_scripts=False)
    configure()
    bake_all(worker, job["max_texels"])
    bpy.data.orphans_purge(do_recursive=True)
    out = Path(job["out_path"])
    temporary = out.with_name(f"{out.stem}.tmp.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(temporary), compress=False, copy=True)
    temporary.replace(out)
    worker.emit("done")


if __name__ == "__main__":
    main()
