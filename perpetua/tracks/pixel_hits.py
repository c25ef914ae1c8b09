"""The exact points where rays through pixels meet opaque meshes."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.geometry.pinhole import Intrinsics, unproject
from perpetua.geometry.transforms import transform_points
from perpetua.tracks.ray_caster import NOTHING, SceneRayCaster
from perpetua.tracks.surface import BoundPoints, SurfacePoints, bind, plane_barycentric


@dataclass(frozen=True)
class PixelHits:
    """What pixels show; ``place`` says which of the pixels asked for meet something."""

    place: Int64[np.ndarray, " N"]
    bound: BoundPoints


def hit_pixels(
    ray_caster: SceneRayCaster,
    intrinsics: Intrinsics,
    world_from_camera: Float64[np.ndarray, "4 4"],
    frame: int,
    pixel_px: Float64[np.ndarray, "M 2"],
) -> PixelHits:
    """Casts a ray through each pixel at a frame. Pixels that show nothing, or a triangle without area, are left out."""
    eye_m = world_from_camera[:3, 3].copy()
    direction = transform_points(world_from_camera, unproject(intrinsics, pixel_px, np.ones(len(pixel_px)))) - eye_m
    hits = ray_caster.first_hit(frame, eye_m, direction)
    met = np.flatnonzero(hits.object_index != NOTHING)
    unit = direction[met] / np.linalg.norm(direction[met], axis=1, keepdims=True)
    place_m = eye_m + hits.distance_m[met, None] * unit
    anywhere = SurfacePoints(hits.object_index[met], hits.face[met], np.zeros((len(met), 3)))
    bound = bind(ray_caster.meshes, anywhere)
    weight = plane_barycentric(place_m, bound.corner_m(frame))
    sound = np.isfinite(weight).all(axis=1)
    weight = np.clip(weight[sound], 0.0, None)
    weight /= weight.sum(axis=1, keepdims=True)
    points = SurfacePoints(anywhere.object_index[sound], anywhere.face[sound], weight)
    return PixelHits(met[sound], bind(ray_caster.meshes, points))
