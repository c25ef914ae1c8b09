"""What views show: which actors they have in the image and in sight, by ray casting against the true triangles."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.geometry.pinhole import inside_image, project
from perpetua.geometry.raycast import Caster
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath

POINTS = 16
UPPER_BODY_LEVEL = 0.5
SEEN_FRACTION = 0.5


@dataclass(frozen=True)
class ViewCoverage:
    """What C views show of A actors over T frames.

    ``seen_fraction`` is the share of an actor's head and torso points that lie inside the image with no triangle of
    the room between. ``apart_rad`` is the angle at each actor, in the plane, between the two most different of the
    views that see it: at least ``SEEN_FRACTION`` of it. Where fewer than two do it is NaN.
    """

    seen_fraction: Float64[np.ndarray, "C T A"]
    apart_rad: Float64[np.ndarray, "T A"]

    @property
    def sees(self) -> Bool[np.ndarray, "C T A"]:
        """Which views see which actors."""
        return np.asarray(self.seen_fraction >= SEEN_FRACTION)


def view_coverage(paths: tuple[CameraPath, ...], actors: tuple[ActorMesh, ...], caster: Caster) -> ViewCoverage:
    """Measures the views; ``caster`` casts against the room's meshes."""
    points_m = np.stack([_upper_body_m(actor) for actor in actors], axis=1)
    seen = np.stack([_seen_fraction(path, points_m, caster) for path in paths])
    positions_m = np.stack([path.world_from_camera[:, :3, 3] for path in paths])
    return ViewCoverage(seen, _apart_rad(positions_m, points_m.mean(axis=2), seen >= SEEN_FRACTION))


def _upper_body_m(actor: ActorMesh) -> Float64[np.ndarray, "T N 3"]:
    """The same few vertices in every frame: spread evenly over those of the upper body in the first."""
    height_m = actor.vertices_m[0, :, 2]
    level = (height_m - height_m.min()) / max(float(np.ptp(height_m)), 1e-6)
    upper = np.flatnonzero(level > UPPER_BODY_LEVEL)
    chosen = upper[np.linspace(0, len(upper) - 1, POINTS).astype(int)]
    return np.asarray(actor.vertices_m[:, chosen], np.float64)


def _seen_fraction(path: CameraPath, points_m: Float64[np.ndarray, "T A N 3"], caster: Caster) -> np.ndarray:
    frames, actors, count, _ = points_m.shape
    flat_m = points_m.reshape(frames, -1, 3)
    in_camera_m = transform_points(invert_rigid(path.world_from_camera), flat_m)
    inside = inside_image(path.intrinsics, project(path.intrinsics, in_camera_m))
    origins_m = np.broadcast_to(path.world_from_camera[:, None, :3, 3], flat_m.shape)
    inside[inside] = caster.clear(origins_m[inside], flat_m[inside])
    return np.asarray(inside.reshape(frames, actors, count).mean(axis=-1))


def _apart_rad(
    positions_m: Float64[np.ndarray, "C T 3"],
    middle_m: Float64[np.ndarray, "T A 3"],
    sees: Bool[np.ndarray, "C T A"],
) -> Float64[np.ndarray, "T A"]:
    offset = positions_m[:, :, None, :2] - middle_m[None, :, :, :2]
    azimuth = np.arctan2(offset[..., 1], offset[..., 0])
    between = np.abs(azimuth[:, None] - azimuth[None])
    between = np.where(sees[:, None] & sees[None], np.minimum(between, 2.0 * np.pi - between), 0.0)
    return np.where(sees.sum(axis=0) >= 2, between.max(axis=(0, 1)), np.nan)
