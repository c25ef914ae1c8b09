"""Points that may become tracks: on rendered surfaces of the room, and on the meshes of actors."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.geometry.mesh import face_areas_m2
from perpetua.geometry.pinhole import unproject
from perpetua.geometry.planes import Planes
from perpetua.geometry.raycast import NO_FACE, MovingCaster
from perpetua.geometry.transforms import transform_points
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.scene import RenderedView
from perpetua.tracks.surface import SceneMeshes, SurfacePoints, join_points, plane_barycentric
from perpetua.tracks.watertight import connected_surfaces

SAMPLED_IMAGES = 64
COVER_M = 0.04
COVER_GAP_M = 1e-4


@dataclass(frozen=True)
class PixelRays:
    """Rays through points of pixels that show the room, with what those pixels show."""

    origin_m: Float64[np.ndarray, "N 3"]
    direction: Float64[np.ndarray, "N 3"]
    object_index: Int64[np.ndarray, " N"]


class StaticSurfaces:
    """Draws points on surfaces of the room that some view shows."""

    def __init__(self, meshes: SceneMeshes, cameras: tuple[CameraPath, ...], views: tuple[RenderedView, ...]) -> None:
        self.meshes, self.cameras, self.views = meshes, cameras, views
        self.surfaces = meshes.joined

    def draw(self, count: int, rng: np.random.Generator) -> SurfacePoints:
        """About ``count`` points, spread evenly over views and times, and in each image over objects."""
        images = [(view, frame) for view in range(len(self.views)) for frame in self._frames(rng)]
        fraction = -(-count // len(images))
        rays = [self._rays(view, frame, fraction, rng) for view, frame in images]
        origin_m = np.concatenate([ray.origin_m for ray in rays])
        direction = np.concatenate([ray.direction for ray in rays])
        shown = np.concatenate([ray.object_index for ray in rays])
        return self._on_mesh(origin_m, direction, shown)

    def _frames(self, rng: np.random.Generator) -> list[int]:
        """Frames at even distances with a random start, as many as make ``SAMPLED_IMAGES`` over all views."""
        frames = len(self.views[0].depth_m)
        wanted = min(frames, max(1, SAMPLED_IMAGES // len(self.views)))
        place = (np.arange(wanted) + rng.random()) * frames / wanted
        return [int(frame) for frame in np.minimum(place, frames - 1)]

    def _rays(self, view: int, frame: int, count: int, rng: np.random.Generator) -> PixelRays:
        shown = np.asarray(self.views[view].object_index[frame]).reshape(-1)
        pixel = np.flatnonzero(np.isin(shown, list(self.meshes.static)))
        if len(pixel) == 0:
            return PixelRays(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0, np.int64))
        pixels_of = np.bincount(shown[pixel])
        weight = np.cumsum(1.0 / np.sqrt(pixels_of[shown[pixel]]))
        drawn = pixel[np.minimum(np.searchsorted(weight, rng.random(count) * weight[-1]), len(pixel) - 1)]
        camera = self.cameras[view]
        row, column = np.divmod(drawn, camera.intrinsics.width_px)
        pixel_px = np.stack([column, row], axis=1) + rng.random((count, 2)) - 0.5
        world_from_camera = camera.world_from_camera[frame]
        end_m = transform_points(world_from_camera, unproject(camera.intrinsics, pixel_px, np.ones(count)))
        origin_m = np.repeat(world_from_camera[None, :3, 3], count, axis=0)
        return PixelRays(origin_m, end_m - origin_m, shown[drawn].astype(np.int64))

    def _on_mesh(
        self,
        origin_m: Float64[np.ndarray, "N 3"],
        direction: Float64[np.ndarray, "N 3"],
        shown: Int64[np.ndarray, " N"],
    ) -> SurfacePoints:
        """The exact points where rays meet the object that their pixel shows; other rays are dropped."""
        hits = self.surfaces.caster.first_hit(origin_m, direction)
        found = np.flatnonzero(hits.hit)
        found = found[self.surfaces.object_index[hits.face[found]] == shown[found]]
        joined = self.surfaces.mesh
        corner_m = joined.vertices_m[joined.faces[hits.face[found]]]
        weight = plane_barycentric(_plane_point(origin_m[found], direction[found], corner_m), corner_m)
        sound = np.isfinite(weight).all(axis=1) & (weight > -1e-3).all(axis=1)
        weight = np.clip(weight[sound], 0.0, None)
        weight /= weight.sum(axis=1, keepdims=True)
        face = self.surfaces.face[hits.face[found]]
        return SurfacePoints(shown[found][sound].astype(np.int32), face[sound], weight)


def _plane_point(
    origin_m: Float64[np.ndarray, "N 3"], direction: Float64[np.ndarray, "N 3"], corner_m: Float64[np.ndarray, "N 3 3"]
) -> Float64[np.ndarray, "N 3"]:
    normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.einsum("nc,nc->n", normal, corner_m[:, 0] - origin_m) / np.einsum("nc,nc->n", normal, direction)
        return np.asarray(origin_m + along[:, None] * direction)


class ActorSurfaces:
    """Draws points on actors, as many on each, area-weighted at a middle frame, none under a garment."""

    def __init__(self, actors: tuple[ActorMesh, ...]) -> None:
        self.actors = actors
        self.weight = [np.cumsum(_seen_areas_m2(actor)) for actor in actors]

    def draw(self, count: int, rng: np.random.Generator) -> SurfacePoints:
        """About ``count`` points."""
        fraction = -(-count // len(self.actors))
        groups = []
        for actor, weight in zip(self.actors, self.weight, strict=True):
            face = np.searchsorted(weight, rng.random(fraction) * weight[-1], side="right")
            face = np.minimum(face, len(weight) - 1).astype(np.int32)
            groups.append(SurfacePoints(np.full(fraction, actor.object_index, np.int32), face, _inside(fraction, rng)))
        return join_points(groups)


def _seen_areas_m2(actor: ActorMesh) -> Float64[np.ndarray, " F"]:
    """Area of each face, 0 where something covers it.

    A face is covered when another connected surface of the actor lies close over its middle at each of a few times,
    as a shirt lies over skin and a lock of hair over another. Rendered depth alone cannot tell skin from cloth a few
    millimetres above it.
    """
    surface = connected_surfaces(actor.vertices_m[0], actor.faces)
    frames = len(actor.vertices_m)
    covered = np.ones(len(surface), bool)
    caster = MovingCaster(np.asarray(actor.vertices_m[0]), actor.faces)
    limit_m = np.full(len(surface), COVER_M, np.float32)
    for frame in sorted({frames // 2, frames - 1}):
        caster.move_to(np.asarray(actor.vertices_m[frame]))
        corner_m = caster.corner_m(np.arange(len(surface), dtype=np.int32))
        normal = Planes.of(corner_m).normal
        origins = (corner_m.mean(axis=1) + COVER_GAP_M * normal).astype(np.float32)
        face = caster.meet(origins, normal.astype(np.float32), limit_m).face
        covered &= (face != NO_FACE) & (surface[face] != surface)
    return np.where(covered, 0.0, face_areas_m2(actor.vertices_m[frames // 2], actor.faces))


def _inside(count: int, rng: np.random.Generator) -> Float64[np.ndarray, "N 3"]:
    """Uniform in a triangle (Osada et al. 2002, Shape Distributions)."""
    root, other = np.sqrt(rng.random(count)), rng.random(count)
    return np.stack([1.0 - root, root * (1.0 - other), root * other], axis=1)
