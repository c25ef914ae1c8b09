"""Normals, scene flow and optical flow of the surfaces that pixels show."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, UInt8

from perpetua.geometry.pinhole import inside_image, project
from perpetua.geometry.transforms import transform_points
from perpetua.labels.pixels import LabelledScene, PixelSurfaces
from perpetua.tracks.ray_caster import NOTHING
from perpetua.tracks.visibility import REACHED_FRACTION, REACHED_M

# States of a pixel's point in another image.
NONE, SEEN, HIDDEN, OUTSIDE = range(4)


@dataclass(frozen=True)
class PixelFlow:
    """Flow of pixels to another image, in pixels, and whether that image shows their points.

    ``state``: 1 seen; 2 hidden by something; 3 outside the image; 0, with a flow of 0, behind the camera.
    """

    flow_px: Float64[np.ndarray, "N 2"]
    state: UInt8[np.ndarray, " N"]


def normals(scene: LabelledScene, surfaces: PixelSurfaces) -> Float64[np.ndarray, "N 3"]:
    """Unit normals of the triangles, in the axes of the camera (X right, Y down, Z forward), on the side it sees."""
    corner_m = surfaces.bound.corner_m(surfaces.frame)
    normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
    pose = scene.cameras[surfaces.view].camera_from_world[surfaces.frame]
    in_camera = (normal / np.linalg.norm(normal, axis=1, keepdims=True)) @ pose[:3, :3].T
    point_m = transform_points(pose, surfaces.bound.point_m(surfaces.frame))
    away = np.einsum("nc,nc->n", in_camera, point_m) > 0.0
    return np.where(away[:, None], -in_camera, in_camera)


def scene_flow_m(surfaces: PixelSurfaces, frame: int) -> Float64[np.ndarray, "N 3"]:
    """World displacement of the pixels' points to another frame, metres; exactly 0 on rigid objects."""
    return surfaces.bound.point_m(frame) - surfaces.bound.point_m(surfaces.frame)


def flow(scene: LabelledScene, surfaces: PixelSurfaces, view: int, frame: int) -> PixelFlow:
    """Flow of the pixels' points to the image of a view and frame."""
    camera = scene.cameras[view]
    pose = camera.camera_from_world[frame]
    point_m = surfaces.bound.point_m(frame)
    other_px = project(camera.intrinsics, transform_points(pose, point_m))
    ahead = np.isfinite(other_px).all(axis=1)
    inside = inside_image(camera.intrinsics, other_px)
    state = np.where(ahead, OUTSIDE, NONE).astype(np.uint8)
    chosen = np.flatnonzero(inside)
    eye_m = -pose[:3, 3] @ pose[:3, :3]
    offset_m = point_m[chosen] - eye_m
    met = scene.ray_caster.first_hit(frame, eye_m, offset_m)
    points = surfaces.bound.points
    length_m = np.linalg.norm(offset_m, axis=1)
    reached = met.distance_m >= length_m * (1.0 - REACHED_FRACTION) - REACHED_M
    reached |= (met.object_index == points.object_index[chosen]) & (met.face == points.face[chosen])
    reached |= met.object_index == NOTHING
    state[chosen] = np.where(reached, SEEN, HIDDEN)
    return PixelFlow(np.where(ahead[:, None], other_px - surfaces.pixel_px, 0.0), state)
