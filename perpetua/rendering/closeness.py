"""How close cameras get to the surfaces of a room: what decides how fine their textures have to be."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int32, UInt16

from perpetua.geometry.pinhole import Intrinsics, unproject
from perpetua.geometry.raycast import Caster
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

# Poses per camera and rays per image side: 4 cameras look at a room along 400,000 rays, in about 2 s.
MAX_POSES = 48
RAYS_PER_SIDE = 48
# No texture is worth more texels than a surface at this distance needs.
NEAREST_M = 0.3


@dataclass(frozen=True)
class Closeness:
    """What rays from all cameras met: an object, a triangle of its mesh, and the pixels per metre of surface there."""

    object_index: UInt16[np.ndarray, " N"]
    triangle: Int32[np.ndarray, " N"]
    pixels_per_m: Float32[np.ndarray, " N"]


def measure_closeness(room: Room, cameras: tuple[CameraPath, ...]) -> Closeness:
    """Looks along every camera's path, through evenly spread pixels; actors hide nothing.

    Pixels per metre are those of a surface that faces the camera: the side along which a slanted one is seen in full.
    """
    surfaces = room.surfaces
    if not len(surfaces.object_index):
        return Closeness(np.zeros(0, np.uint16), np.zeros(0, np.int32), np.zeros(0, np.float32))
    caster = surfaces.caster
    faces, densities = zip(*(_look(caster, camera) for camera in cameras), strict=True)
    face, density = np.concatenate(faces), np.concatenate(densities)
    return Closeness(surfaces.object_index[face].astype(np.uint16), surfaces.face[face], density.astype(np.float32))


def _look(caster: Caster, camera: CameraPath) -> tuple[Int32[np.ndarray, " N"], Float64[np.ndarray, " N"]]:
    """Faces that one camera meets, and pixels per metre on them."""
    intrinsics = camera.intrinsics
    count = len(camera.world_from_camera)
    chosen = np.unique(np.round(np.linspace(0, count - 1, min(count, MAX_POSES))).astype(int))
    poses = camera.world_from_camera[chosen]
    rays = _rays(intrinsics)
    directions = np.einsum("tij,nj->tni", poses[:, :3, :3], rays).reshape(-1, 3)
    origins_m = np.repeat(poses[:, :3, 3], len(rays), axis=0)
    hits = caster.first_hit(origins_m, directions)
    # Rays have Z = 1 in the camera, so their unit vectors turn length into depth.
    depth_m = hits.distance_m / np.tile(np.linalg.norm(rays, axis=1), len(poses))
    focal_px = max(intrinsics.fx_px, intrinsics.fy_px)
    return hits.face[hits.hit], focal_px / np.maximum(depth_m[hits.hit], NEAREST_M)


def _rays(intrinsics: Intrinsics) -> Float64[np.ndarray, "N 3"]:
    """Directions in the camera, with Z = 1, through the middles of a grid of cells over the image."""
    place = (np.arange(RAYS_PER_SIDE) + 0.5) / RAYS_PER_SIDE
    u, v = np.meshgrid(place * intrinsics.width_px - 0.5, place * intrinsics.height_px - 0.5)
    pixels_px = np.stack([u.ravel(), v.ravel()], axis=-1)
    return unproject(intrinsics, pixels_px, np.ones(len(pixels_px)))
