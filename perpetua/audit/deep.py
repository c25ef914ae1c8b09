"""Checks of a sequence against the meshes it was made from, by rays that share no code with what made it.

Rays are trimesh's (Embree, with trimesh's own scaling); depth along them is computed in double precision from the
planes of the triangles met.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float64, Int64

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import SequenceFiles
from perpetua.audit.geometry import NEIGHBOUR_PIXELS, camera_centre_m, depth_of_planes, project_to_pixels
from perpetua.audit.on_meshes import check_on_meshes
from perpetua.audit.report import Check
from perpetua.audit.tally import Tally, check_of
from perpetua.scene.scene import Scene

NOTHING = 0
# Depth bends by more than this share of itself from pixel to pixel only at silhouettes and creases.
BEND_FRACTION = 0.01
# A ray has reached a point this far before it, metres: single precision may pick the next triangle at an edge.
REACHED_M = 1e-4
# A pixel shows a track's own surface where what its ray meets is this near to the plane of the track's triangle.
SAME_DEPTH_M = 2e-3


@dataclass(frozen=True)
class _Met:
    """What rays meet: object (0: nothing), the triangle's corners, its face within the object."""

    object_index: Int64[np.ndarray, " N"]
    face: Int64[np.ndarray, " N"]
    triangle_m: Float64[np.ndarray, "N 3 3"]


@dataclass(frozen=True)
class Reach:
    """How rays to points ended: whether at the point; the object and face they met (0 and -1: nothing), and how far
    before the point that is."""

    reached: Bool[np.ndarray, " N"]
    object_index: Int64[np.ndarray, " N"]
    face: Int64[np.ndarray, " N"]
    short_m: Float64[np.ndarray, " N"]


class _Part:
    """Some objects as one mesh for rays."""

    def __init__(self, meshes: list[tuple[int, np.ndarray, np.ndarray]]) -> None:
        sizes = [len(faces) for _, _, faces in meshes]
        self.owner = np.repeat([index for index, _, _ in meshes], sizes)
        self.face = np.concatenate([np.arange(size) for size in sizes]) if sizes else np.zeros(0, int)
        corners = [np.asarray(vertices, np.float64)[faces] for _, vertices, faces in meshes]
        self.triangle_m = np.concatenate(corners) if corners else np.zeros((0, 3, 3))
        soup = np.arange(3 * len(self.triangle_m)).reshape(-1, 3)
        self.shape = trimesh.Trimesh(self.triangle_m.reshape(-1, 3), soup, process=False) if len(soup) else None

    def first(self, origin_m: np.ndarray, direction: np.ndarray) -> Int64[np.ndarray, " N"]:
        """The triangle that each ray meets first, -1 for none."""
        if self.shape is None:
            return np.full(len(direction), -1)
        origins = np.repeat(origin_m[None], len(direction), axis=0)
        return np.asarray(self.shape.ray.intersects_first(origins, direction), np.int64)


class SceneRays:
    """Rays at a scene, frame by frame."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        objs = [obj for obj in scene.room.objects if obj.opaque]
        self.room = _Part([(obj.object_index, obj.mesh.vertices_m, obj.mesh.faces) for obj in objs])
        self.people, self.frame = _Part([]), -1

    def meet(self, frame: int, origin_m: Float64[np.ndarray, "3"], direction: Float64[np.ndarray, "N 3"]) -> _Met:
        """What rays from one point meet first."""
        if frame != self.frame:
            self.people = _Part([(a.object_index, a.vertices_m[frame], a.faces) for a in self.scene.actors])
            self.frame = frame
        met = _Met(np.zeros(len(direction), np.int64), np.full(len(direction), -1), np.zeros((len(direction), 3, 3)))
        nearest = np.full(len(direction), np.inf)
        for part in (self.room, self.people):
            triangle = part.first(origin_m, direction)
            rays = np.flatnonzero(triangle >= 0)
            reach = _along(origin_m, direction[rays], part.triangle_m[triangle[rays]])
            closer = reach < nearest[rays]
            rays, triangle = rays[closer], triangle[rays][closer]
            nearest[rays] = reach[closer]
            met.object_index[rays], met.face[rays] = part.owner[triangle], part.face[triangle]
            met.triangle_m[rays] = part.triangle_m[triangle]
        return met

    def reach(
        self,
        frame: int,
        origin_m: Float64[np.ndarray, "3"],
        point_m: Float64[np.ndarray, "N 3"],
        object_index: Int64[np.ndarray, " N"],
        face: Int64[np.ndarray, " N"],
    ) -> Reach:
        """Whether rays from one point reach others, which lie on known faces of objects, before anything else."""
        offset_m = point_m - origin_m
        met = self.meet(frame, origin_m, offset_m)
        own = (met.object_index == object_index) & (met.face == face)
        short_m = (1.0 - _along(origin_m, offset_m, met.triangle_m)) * np.linalg.norm(offset_m, axis=1)
        reached = own | (met.object_index == NOTHING) | (short_m <= REACHED_M)
        return Reach(reached, met.object_index, met.face, short_m)


def _along(
    origin_m: Float64[np.ndarray, "3"], direction: Float64[np.ndarray, "N 3"], triangle_m: Float64[np.ndarray, "N 3 3"]
) -> Float64[np.ndarray, " N"]:
    """How many directions' lengths it is to the planes of triangles."""
    normal = np.cross(triangle_m[:, 1] - triangle_m[:, 0], triangle_m[:, 2] - triangle_m[:, 0])
    with np.errstate(divide="ignore", invalid="ignore"):
        height = ((triangle_m[:, 0] - origin_m) * normal).sum(axis=1)
        return np.nan_to_num(height / (direction * normal).sum(axis=1), nan=np.inf)


def verify_deep(
    files: SequenceFiles, table: dict[str, np.ndarray], scene: Scene, bounds: AuditConfig, frames: int
) -> list[Check]:
    """Casts rays for depth, object and visibility, and looks where the meshes have the tracks.

    Args:
        files: the sequence, complete.
        table: ``object_index``, ``face`` and ``barycentric`` of each track, as recorded.
        scene: the meshes it was made from.
        bounds: shares that must agree, and how closely depth must.
        frames: how many frames are looked at, at even distances.
    """
    rays = SceneRays(scene)
    words = "differs from what a ray at the meshes meets"
    depth, objects = Tally(words, bounds.deep_agreement), Tally(words, bounds.deep_agreement)
    visibility = Tally("differs from what a ray at the meshes says", bounds.deep_visibility)
    total = len(files.arrays["tracks_xyz.npy"])
    chosen = np.unique(np.linspace(0, total - 1, frames).round().astype(int)).tolist()
    for frame in chosen:
        for view in files.views:
            predicted_m, owner = predict_image(files, rays, view, frame)
            clear = off_silhouettes(predicted_m, owner)
            rendered_m = np.asarray(files.of_view(int(view), "depth.npy")[frame], np.float64)
            allowed_m = bounds.deep_depth_m + bounds.deep_depth_share * predicted_m
            depth.add(f"{view}/depth.npy[{frame}", np.abs(rendered_m - predicted_m) > allowed_m, clear)
            name, differs = _other_object(files, rays, view, frame, owner)
            objects.add(name, differs, clear)
            seen = _evidence(files, table, rays, view, frame, owner, predicted_m)
            visible = np.asarray(files.of_view(int(view), "visibility.npy")[frame])
            # Entries off the image count: calling them visible would be wrong. What no pixel around shows, or none at
            # the point's depth, is hidden by the format's rule.
            wrong = np.where(seen.plain, visible != seen.reached, visible & ~(seen.reached & seen.shown))
            visibility.add(f"{view}/visibility.npy[{frame}", wrong)
    return [
        check_of("depth by rays", [depth]),
        check_of("objects by rays", [objects]),
        check_of("visibility by rays", [visibility]),
        check_on_meshes(files, table, scene, bounds, chosen),
    ]


def _other_object(
    files: SequenceFiles, rays: SceneRays, view: str, frame: int, owner: Int64[np.ndarray, "H W"]
) -> tuple[str, Bool[np.ndarray, "H W"]]:
    """The name of what is compared, and the pixels where it differs from ``owner``, the objects that rays meet: the
    object index, or the mask of the actors where there is no index."""
    if rays.scene.object_index is not None:
        return f"object index of view {view}[{frame}", owner != rays.scene.object_index[int(view)][frame]
    on_actor = np.isin(owner, [actor.object_index for actor in rays.scene.actors])
    return f"{view}/foreground_mask.npy[{frame}", on_actor != files.of_view(int(view), "foreground_mask.npy")[frame]


def predict_image(
    files: SequenceFiles, rays: SceneRays, view: str, frame: int
) -> tuple[Float64[np.ndarray, "H W"], Int64[np.ndarray, "H W"]]:
    """Depth (0: nothing) and object at each pixel centre."""
    intrinsics, pose = files.of_view(int(view), "intrinsics.npy"), files.of_view(int(view), "extrinsics_w2c.npy")[frame]
    _, height, width = files.of_view(int(view), "depth.npy").shape
    row, column = np.mgrid[:height, :width].reshape(2, -1)
    fx, fy, cx, cy = np.asarray(intrinsics, np.float64)
    local = np.stack([(column - cx) / fx, (row - cy) / fy, np.ones(len(column))], axis=1)
    met = rays.meet(frame, camera_centre_m(pose), local @ np.asarray(pose[:3, :3], np.float64))
    depth_m = depth_of_planes(intrinsics, pose, met.triangle_m, column, row)
    depth_m = np.where(met.object_index == NOTHING, 0.0, depth_m)
    return depth_m.reshape(height, width), met.object_index.reshape(height, width)


def off_silhouettes(depth_m: Float64[np.ndarray, "H W"], owner: Int64[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Pixels all of whose neighbours show the same object on a surface that does not bend."""
    clear = np.zeros(owner.shape, bool)
    same = np.ones((owner.shape[0] - 2, owner.shape[1] - 2), bool)
    for shifted in _neighbours(owner):
        same &= shifted == owner[1:-1, 1:-1]
    middle = depth_m[1:-1, 1:-1]
    across = np.abs(depth_m[1:-1, 2:] + depth_m[1:-1, :-2] - 2 * middle)
    down = np.abs(depth_m[2:, 1:-1] + depth_m[:-2, 1:-1] - 2 * middle)
    clear[1:-1, 1:-1] = same & (np.maximum(across, down) <= BEND_FRACTION * middle) & (middle > 0)
    return clear


def _neighbours(values: np.ndarray) -> Iterator[np.ndarray]:
    height, width = values.shape
    for down in range(3):
        for right in range(3):
            yield values[down : height - 2 + down, right : width - 2 + right]


@dataclass(frozen=True)
class _Evidence:
    """Of each track: whether the ray from the camera reaches it on the image; whether rays of the four pixel centres
    around meet its object, and whether they do so at its own surface's depth."""

    reached: Bool[np.ndarray, " P"]
    shown: Bool[np.ndarray, " P"]
    plain: Bool[np.ndarray, " P"]


def _evidence(
    files: SequenceFiles,
    table: dict[str, np.ndarray],
    rays: SceneRays,
    view: str,
    frame: int,
    owner: Int64[np.ndarray, "H W"],
    predicted_m: Float64[np.ndarray, "H W"],
) -> _Evidence:
    """What rays say of the tracks in one image; ``owner`` and ``predicted_m`` are those of ``predict_image``."""
    camera = files.of_view(int(view), "intrinsics.npy"), files.of_view(int(view), "extrinsics_w2c.npy")[frame]
    point_m = np.asarray(files.arrays["tracks_xyz.npy"][frame], np.float64)
    seen = project_to_pixels(*camera, point_m)
    height, width = owner.shape
    with np.errstate(invalid="ignore"):
        inside = (seen[:, 2] > 0) & (np.abs(seen[:, 0] - (width - 1) / 2) < width / 2)
        inside &= np.abs(seen[:, 1] - (height - 1) / 2) < height / 2
    chosen = np.flatnonzero(inside)
    object_index, face = table["object_index"][chosen], table["face"][chosen]
    reached, shown, plain = (np.zeros(len(point_m), bool) for _ in range(3))
    reached[chosen] = rays.reach(frame, camera_centre_m(camera[1]), point_m[chosen], object_index, face).reached
    corner = np.floor(seen[chosen, :2]).astype(np.int64)[:, None] + NEIGHBOUR_PIXELS
    on_image = ((corner >= 0) & (corner < [width, height])).all(axis=2)
    column, row = np.clip(corner[..., 0], 0, width - 1), np.clip(corner[..., 1], 0, height - 1)
    own = on_image & (owner[row, column] == object_index[:, None])
    shown[chosen] = own.any(axis=1)
    triangle_m = np.asarray(files.arrays["surface_xyz.npy"][frame], np.float64)[chosen]
    planes_m = [depth_of_planes(*camera, triangle_m, column[:, k], row[:, k]) for k in range(len(NEIGHBOUR_PIXELS))]
    off_m = np.abs(predicted_m[row, column] - np.stack(planes_m, axis=1))
    plain[chosen] = (own & (off_m <= SAME_DEPTH_M)).any(axis=1)
    return _Evidence(reached, shown, plain)
