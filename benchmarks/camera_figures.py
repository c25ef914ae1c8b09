"""Figures of camera paths, measured from meshes by trimesh and FCL; nothing here is used to plan them."""

from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Bool, Float64

from perpetua.audit.clearance import points_to_mesh_m, points_to_moving_mesh_m
from perpetua.geometry.mesh import TriMesh, join
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

SUBSTEPS = 4
BODY_POINTS = 30
# Rays end this far before the body point they are to reach.
SHORT_M = 0.01
REVISIT_M, REVISIT_S = 0.35, 2.5
CROWDED_IMAGES = 1.2
# What other actors hide is measured at every n-th frame: for each of them their meshes are indexed anew.
ACTOR_STRIDE = 8


@dataclass(frozen=True)
class Sight:
    """What C views show of N head and torso points of each of A actors at T frames.

    ``past_actors`` is known, and otherwise true, at every ``ACTOR_STRIDE``-th frame.
    """

    in_image: Bool[np.ndarray, "C T A N"]
    past_scene: Bool[np.ndarray, "C T A N"]
    past_actors: Bool[np.ndarray, "C T A N"]

    @property
    def sees(self) -> Bool[np.ndarray, "C T A"]:
        """Whether a view has at least half of an actor's points in its image and unhidden by the scene."""
        return np.asarray((self.in_image & self.past_scene).mean(axis=-1) >= 0.5)


def scene_mesh(room: Room) -> trimesh.Trimesh:
    """All of a room's triangles."""
    mesh = join([obj.mesh for obj in room.objects])
    return trimesh.Trimesh(mesh.vertices_m, mesh.faces, process=False)


def measure_sight(paths: tuple[CameraPath, ...], actors: tuple[ActorMesh, ...], scene: trimesh.Trimesh) -> Sight:
    """Casts a ray from every view to every point at every frame, against the room and against all actors."""
    points_m = np.stack([_upper_body_m(actor) for actor in actors], axis=1)
    in_image = np.stack([_in_image(path, points_m) for path in paths])
    past_scene, past_actors = np.zeros_like(in_image), np.ones_like(in_image)
    positions_m = np.stack([path.world_from_camera[:, :3, 3] for path in paths])
    past_scene[in_image] = _reached(scene, *_rays(positions_m, points_m, in_image))
    for frame in range(0, points_m.shape[0], ACTOR_STRIDE):
        everyone = join([TriMesh(actor.vertices_m[frame].astype(np.float64), actor.faces) for actor in actors])
        rays = _rays(positions_m[:, [frame]], points_m[[frame]], in_image[:, [frame]])
        bodies = trimesh.Trimesh(everyone.vertices_m, everyone.faces, process=False)
        past_actors[:, frame][in_image[:, frame]] = _reached(bodies, *rays)
    return Sight(in_image, past_scene, past_actors)


def figures(
    paths: tuple[CameraPath, ...],
    focus: Bool[np.ndarray, "C T A"],
    actors: tuple[ActorMesh, ...],
    scene: trimesh.Trimesh,
    fps: float,
) -> dict[str, float]:
    """Everything the tables show, by name; shares are over (view, frame) pairs or (actor, frame) pairs."""
    sight = measure_sight(paths, actors, scene)
    return _sight_figures(sight, focus) | _place_figures(paths, sight, focus, actors, fps) | _motion_figures(paths, fps)


def clearances(
    paths: tuple[CameraPath, ...], actors: tuple[ActorMesh, ...], scene: trimesh.Trimesh
) -> dict[str, float]:
    """Least distances in metres to the scene and to actors, at four times the frame rate."""
    mesh = TriMesh(np.asarray(scene.vertices, np.float64), np.asarray(scene.faces, np.int32))
    to_scene_m, to_actors_m = [], []
    for path in paths:
        position_m = path.world_from_camera[:, :3, 3]
        time = np.linspace(0.0, len(position_m) - 1.0, SUBSTEPS * (len(position_m) - 1) + 1)
        way_m = np.stack([np.interp(time, np.arange(len(position_m)), position_m[:, i]) for i in range(3)], axis=1)
        to_scene_m.append(points_to_mesh_m(way_m, mesh).min())
        for actor in actors:
            to_actors_m.append(points_to_moving_mesh_m(way_m, time, actor.vertices_m, actor.faces).min())
    return {"scene_m": float(min(to_scene_m)), "actor_m": float(min(to_actors_m))}


def _sight_figures(sight: Sight, focus: Bool[np.ndarray, "C T A"]) -> dict[str, float]:
    sees = sight.sees
    covered = (sees.sum(axis=0) >= 2).mean(axis=0)
    shown = focus[..., None] & sight.in_image
    return {
        "focus": float((sees & focus).any(axis=-1).mean()),
        "focus_worst": float((sees & focus).any(axis=-1).mean(axis=-1).min()),
        "covered": float(covered.mean()),
        "covered_worst": float(covered.min()),
        "focus_points": float(sight.in_image[focus].mean()),
        "behind_scene": float((shown & ~sight.past_scene).sum() / max(shown.sum(), 1)),
        "behind_actors": float((shown & ~sight.past_actors).sum() / max(shown[:, ::ACTOR_STRIDE].sum(), 1)),
    }


def _place_figures(
    paths: tuple[CameraPath, ...],
    sight: Sight,
    focus: Bool[np.ndarray, "C T A"],
    actors: tuple[ActorMesh, ...],
    fps: float,
) -> dict[str, float]:
    middle_m = np.stack([_upper_body_m(actor).mean(axis=1) for actor in actors], axis=1)
    tall_m = np.stack([np.ptp(actor.vertices_m[..., 2], axis=1) for actor in actors], axis=1)
    positions_m = np.stack([path.world_from_camera[:, :3, 3] for path in paths])
    forward = np.stack([path.world_from_camera[:, :3, 2] for path in paths])
    offset_m = middle_m - positions_m[:, :, None]
    distance_m = np.linalg.norm(offset_m, axis=-1)
    off_axis = np.arccos(np.clip((offset_m * forward[:, :, None]).sum(axis=-1) / distance_m, -1.0, 1.0))
    tan_half = np.array([0.5 * path.intrinsics.height_px / path.intrinsics.fy_px for path in paths])[:, None, None]
    images = tall_m / (2.0 * distance_m * tan_half)
    crowded = ((images > CROWDED_IMAGES) & sight.in_image.any(axis=-1)).any(axis=-1)
    return {
        "apart_deg": float(np.nanmean(_apart_deg(offset_m, sight.sees))),
        "height_images": float(np.median(images[focus])),
        "height_spread": float(np.std(np.log(images[focus]))),
        "crowded": float(crowded.mean()),
        "off_axis_deg": float(np.degrees(off_axis[focus].mean())),
        "revisited": float(np.mean([_revisited(path, fps) for path in positions_m])),
    }


def _apart_deg(offset_m: Float64[np.ndarray, "C T A 3"], sees: Bool[np.ndarray, "C T A"]) -> Float64[np.ndarray, "T A"]:
    """The largest angle, in the plane, between two views that see an actor; NaN where fewer than two do."""
    unit = offset_m[..., :2] / np.linalg.norm(offset_m[..., :2], axis=-1, keepdims=True)
    angle = np.degrees(np.arccos(np.clip(np.einsum("ctai,dtai->cdta", unit, unit), -1.0, 1.0)))
    widest = np.where(sees[:, None] & sees[None], angle, 0.0).max(axis=(0, 1))
    return np.where(sees.sum(axis=0) >= 2, widest, np.nan)


def _motion_figures(paths: tuple[CameraPath, ...], fps: float) -> dict[str, float]:
    position_m = np.stack([path.world_from_camera[:, :3, 3] for path in paths])
    rotation = np.stack([path.world_from_camera[:, :3, :3] for path in paths])
    velocity = np.diff(position_m, axis=1) * fps
    acceleration = np.linalg.norm(np.diff(velocity, axis=1) * fps, axis=-1)
    forward = rotation[..., 2]
    turn = np.degrees(np.arccos(np.clip((forward[:, 1:] * forward[:, :-1]).sum(axis=-1), -1.0, 1.0))) * fps
    return {
        "travel_m": float(np.linalg.norm(np.diff(position_m, axis=1), axis=-1).sum(axis=1).mean()),
        "speed_mps": float(np.linalg.norm(velocity, axis=-1).max()),
        "acceleration_mps2": float(acceleration.max()),
        "acceleration_rms": float(np.sqrt((acceleration**2).mean())),
        "turn_dps": float(turn.max()),
        "turn_rms": float(np.sqrt((turn**2).mean())),
        "roll_deg": float(np.degrees(np.arcsin(np.abs(rotation[..., 2, 0]).max()))),
        "pitch_deg": float(np.degrees(np.arcsin(np.abs(forward[..., 2]).max()))),
    }


def _revisited(position_m: Float64[np.ndarray, "T 3"], fps: float) -> float:
    """Share of frames at a place where the camera was some seconds before."""
    near = np.linalg.norm(position_m[:, None] - position_m[None], axis=-1) < REVISIT_M
    before = np.tril(np.ones(near.shape, bool), -round(REVISIT_S * fps))
    return float((near & before).any(axis=1).mean())


def _upper_body_m(actor: ActorMesh) -> Float64[np.ndarray, "T N 3"]:
    """Random vertices of the half of the body that is upper at the first frame."""
    height_m = actor.vertices_m[0, :, 2]
    upper = np.flatnonzero(height_m > 0.5 * (height_m.min() + height_m.max()))
    return actor.vertices_m[:, np.random.default_rng(0).choice(upper, BODY_POINTS, replace=False)].astype(np.float64)


def _in_image(path: CameraPath, points_m: Float64[np.ndarray, "T A N 3"]) -> Bool[np.ndarray, "T A N"]:
    lens = path.intrinsics
    offset_m = points_m - path.world_from_camera[:, None, None, :3, 3]
    x, y, z = np.moveaxis(np.einsum("tji,tanj->tani", path.world_from_camera[:, :3, :3], offset_m), -1, 0)
    safe = np.maximum(z, 1e-6)
    column, row = lens.fx_px * x / safe + lens.cx_px, lens.fy_px * y / safe + lens.cy_px
    inside = (column >= -0.5) & (column < lens.width_px - 0.5) & (row >= -0.5) & (row < lens.height_px - 0.5)
    return np.asarray(inside & (z > 0.0))


def _rays(
    positions_m: Float64[np.ndarray, "C T 3"],
    points_m: Float64[np.ndarray, "T A N 3"],
    chosen: Bool[np.ndarray, "C T A N"],
) -> tuple[Float64[np.ndarray, "R 3"], Float64[np.ndarray, "R 3"]]:
    targets_m = np.broadcast_to(points_m[None], (*chosen.shape, 3))[chosen]
    origins_m = np.broadcast_to(positions_m[:, :, None, None], (*chosen.shape, 3))[chosen]
    return origins_m, targets_m


def _reached(
    mesh: trimesh.Trimesh, origins_m: Float64[np.ndarray, "R 3"], targets_m: Float64[np.ndarray, "R 3"]
) -> Bool[np.ndarray, " R"]:
    """Whether rays from origins come to within ``SHORT_M`` of their targets."""
    reached = np.ones(len(origins_m), bool)
    if len(origins_m) == 0:
        return reached
    length_m = np.linalg.norm(targets_m - origins_m, axis=1)
    unit = (targets_m - origins_m) / length_m[:, None]
    places_m, ray, _ = mesh.ray.intersects_location(origins_m, unit, multiple_hits=False)
    reached[ray] = np.linalg.norm(places_m - origins_m[ray], axis=1) >= length_m[ray] - SHORT_M
    return reached
