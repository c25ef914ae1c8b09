# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes a room's procedural materials to image textures, once per room.

    python bake_materials.py bake.json

The job holds ``blend_path``; ``closeness``, an .npz of what cameras meet (see ``bake_work.collect``); ``max_texels``;
``content``, which stands for the room and these scripts; and ``out_path``, a .blend that appears by rename when all is
done, with its images beside it. Each mesh gets UVs of its own and up to four images: colour; roughness, metalness and
translucency; where they vary, specular level, coat and sheen; and the normal with all bumps, in object space. Objects
that share a mesh share its images. Materials without procedural textures and lamps keep their shaders. Events:
``baked`` for each mesh, ``done``.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import bpy
import numpy as np

from blender_scripts.bake import atlas
from blender_scripts.bake.bake_work import Work, collect
from blender_scripts.bake.baked_images import ImageFiles, refer_relatively
from blender_scripts.bake.baked_materials import BAKED_UV, build_baked_material
from blender_scripts.bake.shader_channels import COLOR, GLOSS, NORMAL, SURFACE, ChannelReader
from blender_scripts.bake.shader_constants import Constants, read_constants
from blender_scripts.worker.link import Worker, read_job

MARGIN_PX = 3
# Points of a texel that are evaluated and averaged: a joint between boards that is finer than a texel would otherwise
# be there or not by chance.
SAMPLES = {COLOR: 6, SURFACE: 2, GLOSS: 1, NORMAL: 2}
# Colours and bumps need every texel; the others have half as many along each side.
COARSER = {COLOR: 1, SURFACE: 2, GLOSS: 2, NORMAL: 1}


class Baker:
    """Bakes the meshes of the open file."""

    def __init__(self, files: ImageFiles) -> None:
        self._files = files
        self._reader = ChannelReader()
        self._rewired: dict[str, dict[str, bpy.types.Node]] = {}
        self._bumps = bumps()
        self._constants: dict[str, Constants] = {}
        self._blank = bpy.data.materials.new("blank")
        self._blank.use_nodes = True

    def bake(self, work: Work) -> tuple[int, int]:
        """Gives one mesh its new material; returns its texels, and how many of its images had to be baked."""
        mesh = work.obj.data
        packing = atlas.pack(work.charts, work.texels_per_m)
        layer = mesh.uv_layers.new(name=BAKED_UV, do_init=False)
        layer.uv.foreach_set("vector", atlas.uv(work.charts, packing, work.texels_per_m).ravel())
        channels = self._channels(work.materials)
        missing = [channel for channel in channels if not self._files.has(work, channel)]
        originals = list(mesh.materials)
        if missing:
            self._bake_channels(work, missing, packing)
        images = {channel: self._files.load(work, channel) for channel in channels}
        for slot, original in enumerate(originals):
            mesh.materials[slot] = original
            if slot in work.slots:
                mesh.materials[slot] = build_baked_material(mesh.name, images, self._constants[original.name_full])
        return packing.width_px * packing.height_px, len(missing)

    def _channels(self, materials: list[bpy.types.Material]) -> list[str]:
        """What differs from place to place on a mesh with these materials."""
        for material in materials:
            if material.name_full not in self._constants:
                self._constants[material.name_full] = read_constants(material)
        channels = [COLOR, SURFACE]
        if any(self._constants[material.name_full].gloss is None for material in materials):
            channels.append(GLOSS)
        if any(material.name_full in self._bumps for material in materials):
            channels.append(NORMAL)
        return channels

    def _bake_channels(self, work: Work, channels: list[str], packing: atlas.Packing) -> None:
        chosen = work.materials
        for material in chosen:
            self._rewire(material)
        for slot in range(len(work.obj.data.materials)):
            if slot not in work.slots:
                work.obj.data.materials[slot] = self._blank
        for channel in channels:
            self._bake_channel(work, channel, chosen, packing)

    def _rewire(self, material: bpy.types.Material) -> None:
        """Gives a material an emission shader for each channel, once."""
        if material.name_full in self._rewired:
            return
        tree = material.node_tree
        output = tree.get_output_node("CYCLES")
        shaders: dict[str, bpy.types.Node] = {}
        for channel in (COLOR, SURFACE, GLOSS):
            value = self._reader.channel(tree, output.inputs["Surface"], channel)
            shaders[channel] = tree.nodes.new("ShaderNodeEmission")
            tree.links.new(value, shaders[channel].inputs["Color"])
        if material.name_full in self._bumps:
            shaders[NORMAL] = tree.nodes.new("ShaderNodeBsdfDiffuse")
        self._rewired[material.name_full] = shaders

    def _bake_channel(
        self, work: Work, channel: str, materials: list[bpy.types.Material], packing: atlas.Packing
    ) -> None:
        """One image of one mesh."""
        image = bpy.data.images.new(
            f"{work.obj.data.name}_{channel}",
            -(-packing.width_px // COARSER[channel]),
            -(-packing.height_px // COARSER[channel]),
            alpha=False,
            float_buffer=channel == NORMAL,
        )
        image.colorspace_settings.name = "sRGB" if channel == COLOR else "Non-Color"
        for material in [*materials, self._blank]:
            self._aim(material, channel, image)
        bpy.context.scene.cycles.samples = SAMPLES[channel]
        bpy.ops.object.bake(
            type="NORMAL" if channel == NORMAL else "EMIT",
            normal_space="OBJECT",
            margin=MARGIN_PX,
            margin_type="EXTEND",
            use_clear=False,
            target="IMAGE_TEXTURES",
            uv_layer=BAKED_UV,
        )
        if channel == NORMAL:
            soften(image, work, packing)
        self._files.store(work, channel, image)
        bpy.data.images.remove(image)

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
        # A material without bumps of its own, beside ones that have some, shows its plain normal with any shader.
        tree.links.new(shaders.get(channel, shaders[COLOR]).outputs[0], output.inputs["Surface"])
        if channel == NORMAL and material.name_full in self._bumps:
            tree.links.new(self._bumps[material.name_full], output.inputs["Displacement"])
            return
        # Bumps cost three more evaluations, and change no value.
        for link in list(output.inputs["Displacement"].links):
            tree.links.remove(link)


def bumps() -> dict[str, bpy.types.NodeSocket]:
    """What displaces the surfaces of each material that does so; it is rendered as bumps."""
    found = {}
    for material in bpy.data.materials:
        output = material.node_tree.get_output_node("CYCLES") if material.use_nodes else None
        if output is not None and output.inputs["Displacement"].is_linked:
            found[material.name_full] = output.inputs["Displacement"].links[0].from_socket
    return found


def soften(image: bpy.types.Image, work: Work, packing: atlas.Packing) -> None:
    """Averages baked normals over as many texels as a pixel of a typical view spans.

    Cycles takes a bump's slope over a pixel: seen from afar, fine bumps are flat. Unless baked ones are averaged
    likewise, they turn a polished floor into sandpaper.
    """
    width, height = image.size
    pixels = np.empty(4 * width * height, np.float32)
    image.pixels.foreach_get(pixels)
    pixels = pixels.reshape(height, width, 4)
    baked = (pixels[..., :3] != 0.0).any(axis=-1)
    boxes = atlas.boxes(work.charts, packing, work.texels_per_m) // COARSER[NORMAL]
    atlas.blur_charts(pixels[..., :3], baked, boxes, work.texels_per_pixel / COARSER[NORMAL])
    image.pixels.foreach_set(pixels.ravel())
    image.update()


def isolate(objs: list[bpy.types.Object]) -> dict[bpy.types.Object, bool]:
    """Hides everything from Cycles, so that a bake loads one object; returns what was hidden before."""
    hidden = {obj: obj.hide_render for obj in objs}
    for obj in objs:
        obj.hide_render = True
        obj.select_set(False)
    return hidden


def configure() -> None:
    """All samples of each texel, on the CPU."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.use_persistent_data = False
    scene.cycles.device = "CPU"
    scene.cycles.use_denoising = False
    scene.cycles.use_adaptive_sampling = False


def bake_all(worker: Worker, works: list[Work], files: ImageFiles) -> None:
    """Bakes meshes of the open file."""
    scene = bpy.context.scene
    world, scene.world = scene.world, None
    hidden = isolate(list(scene.objects))
    baker = Baker(files)
    for work in works:
        worker.check_parent()
        started = time.monotonic()
        work.obj.hide_render = False
        work.obj.select_set(True)
        bpy.context.view_layer.objects.active = work.obj
        texels, images = baker.bake(work)
        work.obj.select_set(False)
        work.obj.hide_render = True
        seconds = time.monotonic() - started
        charts = len(work.charts.size_m)
        worker.emit("baked", mesh=work.obj.name, texels=texels, images=images, charts=charts, seconds=seconds)
    for obj, was_hidden in hidden.items():
        obj.hide_render = was_hidden
    scene.world = world


def main() -> None:
    """Bakes what the job names."""
    worker = Worker()
    job = read_job(worker.job_path())
    bpy.ops.wm.open_mainfile(filepath=job["blend_path"], load_ui=False, use_scripts=False)
    configure()
    with np.load(job["closeness"], allow_pickle=False) as arrays:
        works = collect(dict(arrays), job["max_texels"])
    out = Path(job["out_path"])
    bake_all(worker, works, ImageFiles(out.parent, job["content"]))
    bpy.data.orphans_purge(do_recursive=True)
    refer_relatively()
    temporary = out.with_name(f".{out.stem}.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(temporary), compress=False, copy=True, relative_remap=False)
    temporary.replace(out)
    worker.emit("done")


if __name__ == "__main__":
    main()
