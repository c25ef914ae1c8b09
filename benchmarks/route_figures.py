"""Figures of routes, measured from true triangles by FCL and Embree; nothing here is used to plan them."""

from dataclasses import dataclass

import fcl
import numpy as np
import trimesh
from jaxtyping import Bool, Float64
from scipy.interpolate import make_interp_spline

from perpetua.geometry.mesh import TriMesh, join
from perpetua.navigation.config import NavigationConfig
from perpetua.scene.room import Room

SUBSTEPS = 4
# A body is over the floor where a ray from this height meets a walkable surface so near to the route's height.
RAY_HEIGHT_M, FLOOR_TOLERANCE_M = 0.4, 0.03
VISIT_CELL_M = 0.4
# Slower than this nobody is said to face where it goes.
FACING_MPS = 0.35


@dataclass(frozen=True)
class Motion:
    """Routes of A actors at S equal instants."""

    position_m: Float64[np.ndarray, "A S 3"]
    heading_rad: Float64[np.ndarray, "A S"]
    step_s: float

    @classmethod
    def finely(
        cls, position_m: Float64[np.ndarray, "A T 3"], heading_rad: Float64[np.ndarray, "A T"], step_s: float
    ) -> "Motion":
        """The motion at four times its rate, by quintic splines; heights are those of the nearest frame."""
        frames = position_m.shape[1]
        times = np.arange((frames - 1) * SUBSTEPS + 1) / SUBSTEPS
        xy_m = make_interp_spline(np.arange(frames), position_m[..., :2], k=5, axis=1)(times)
        z_m = position_m[:, np.rint(times).astype(int), 2:]
        fine_rad = make_interp_spline(np.arange(frames), heading_rad, k=5, axis=1)(times)
        return cls(np.concatenate([xy_m, z_m], axis=2), fine_rad, step_s / SUBSTEPS)

    @property
    def velocity_mps(self) -> Float64[np.ndarray, "A S 2"]:
        """Velocity over the floor."""
        return np.asarray(np.gradient(self.position_m[..., :2], self.step_s, axis=1))

    @property
    def speed_mps(self) -> Float64[np.ndarray, "A S"]:
        """Speed over the floor."""
        return np.asarray(np.linalg.norm(self.velocity_mps, axis=2))

    @property
    def acceleration_mps2(self) -> Float64[np.ndarray, "A N"]:
        """Size of the acceleration."""
        return np.asarray(np.linalg.norm(np.diff(self.position_m[..., :2], n=2, axis=1), axis=2) / self.step_s**2)

    @property
    def jerk_mps3(self) -> Float64[np.ndarray, "A N"]:
        """Size of the jerk, over whole frames: finer differences show the spline's knots."""
        whole_m, frame_s = self.position_m[:, ::SUBSTEPS, :2], self.step_s * SUBSTEPS
        return np.asarray(np.linalg.norm(np.diff(whole_m, n=3, axis=1), axis=2) / frame_s**3)

    @property
    def turn_rate_radps(self) -> Float64[np.ndarray, "A N"]:
        """Size of the turn rate."""
        return np.asarray(np.abs(np.diff(self.heading_rad, axis=1)) / self.step_s)

    @property
    def turn_change_radps2(self) -> Float64[np.ndarray, "A N"]:
        """Size of the change of the turn rate, over whole frames."""
        return np.asarray(np.abs(np.diff(self.heading_rad[:, ::SUBSTEPS], n=2, axis=1)) / (self.step_s * SUBSTEPS) ** 2)

    @property
    def least_separation_m(self) -> Float64[np.ndarray, " S"]:
        """Distance of the two actors that are nearest to each other."""
        apart_m = np.linalg.norm(self.position_m[:, None, :, :2] - self.position_m[None, :, :, :2], axis=3)
        apart_m[np.arange(len(apart_m)), np.arange(len(apart_m))] = np.inf
        return np.asarray(apart_m.min(axis=(0, 1)))

    @property
    def off_heading_rad(self) -> Float64[np.ndarray, "A S"]:
        """Angle between heading and motion; 0 for who hardly moves."""
        velocity = self.velocity_mps
        angle = np.angle(np.exp(1j * (np.arctan2(velocity[..., 1], velocity[..., 0]) - self.heading_rad)))
        return np.where(self.speed_mps > FACING_MPS, np.abs(angle), 0.0)

    def farthest_in_m(self, frames: int) -> Float64[np.ndarray, " A"]:
        """The longest way, as the crow flies, that each actor gets within so many frames."""
        window = min(frames * SUBSTEPS, self.position_m.shape[1] - 1)
        return np.asarray(
            np.linalg.norm(self.position_m[:, window:, :2] - self.position_m[:, :-window, :2], axis=2).max(axis=1)
        )

    def cells_per_metre(self) -> float:
        """Squares of floor that actors come through, per metre of way: less for who goes where it has been."""
        cells = sum(len(np.unique(np.floor(way / VISIT_CELL_M), axis=0)) for way in self.position_m[..., :2])
        return float(cells / max(float(self.speed_mps.sum() * self.step_s), 1.0))


class Surroundings:
    """A room's triangles, for a body of the configured size."""

    def __init__(self, room: Room, body: NavigationConfig) -> None:
        self._body = body
        mesh = join([obj.mesh for obj in room.objects])
        model = fcl.BVHModel()
        model.beginModel(len(mesh.vertices_m), len(mesh.faces))
        model.addSubModel(mesh.vertices_m, mesh.faces.astype(np.int64))
        model.endModel()
        self._scene = fcl.CollisionObject(model)
        self._floor = _trimesh(join([obj.mesh for obj in room.objects if obj.walkable]))

    def hits(self, place_m: Float64[np.ndarray, "N 3"], radius_m: float) -> Bool[np.ndarray, " N"]:
        """Whether an upright cylinder over each place, from step height to head, cuts a triangle."""
        height_m = self._body.body_height_m - self._body.step_m
        body = fcl.CollisionObject(fcl.Cylinder(radius_m, height_m))
        middle_m = place_m + np.array([0.0, 0.0, self._body.step_m + 0.5 * height_m])
        found = np.zeros(len(place_m), bool)
        for index, place in enumerate(middle_m):
            body.setTranslation(place)
            found[index] = fcl.collide(body, self._scene, fcl.CollisionRequest(), fcl.CollisionResult()) > 0
        return found

    def off_floor(self, place_m: Float64[np.ndarray, "N 3"]) -> Bool[np.ndarray, " N"]:
        """Whether no walkable surface is at the height of a place."""
        origins_m = place_m + np.array([0.0, 0.0, RAY_HEIGHT_M])
        down = np.tile([0.0, 0.0, -1.0], (len(place_m), 1))
        where_m, ray, _ = self._floor.ray.intersects_location(origins_m, down, multiple_hits=False)
        height_m = np.full(len(place_m), np.inf)
        height_m[ray] = where_m[:, 2]
        return np.asarray(np.abs(height_m - place_m[:, 2]) > FLOOR_TOLERANCE_M)


def _trimesh(mesh: TriMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)
