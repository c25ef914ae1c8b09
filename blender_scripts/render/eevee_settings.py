# SPDX-License-Identifier: GPL-3.0-or-later
"""EEVEE for pictures. It draws by OpenGL (or Metal, or Vulkan), which needs a graphics driver, but no window."""

import bpy

# By age: EEVEE was rewritten in Blender 4.2 and got its old name back in 5.0.
ENGINES = ("BLENDER_EEVEE_NEXT", "BLENDER_EEVEE")


def configure(scene: bpy.types.Scene, settings: dict) -> None:
    """EEVEE with ray-traced reflections and light off screen, at the job's samples."""
    known = {item.identifier for item in scene.render.bl_rna.properties["engine"].enum_items_static_ui}
    scene.render.engine = next((engine for engine in ENGINES if engine in known), ENGINES[-1])
    scene.render.use_persistent_data = True
    scene.render.use_motion_blur = False
    scene.render.film_transparent = False
    scene.render.resolution_percentage = 100
    scene.render.use_border = scene.render.use_multiview = scene.render.use_sequencer = False
    eevee = scene.eevee
    eevee.taa_render_samples = settings["samples"]
    eevee.use_shadows = eevee.use_raytracing = True
    eevee.shadow_ray_count = 2
