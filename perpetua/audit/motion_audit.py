"""Whether people and cameras kept their distance and people were seen: measured on meshes, by code that plans nothing.

Distances are exact (``perpetua.audit.clearance``) and taken at four times the frame rate, with straight lines between
frames. Speeds are differences between frames.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.audit.clearance import FAR_M, pillars_to_mesh_m, points_to_mesh_m, points_to_moving_mesh_m
from perpetua.audit.report import Check
from perpetua.cameras.config import CamerasConfig
from perpetua.geometry.mesh import join
from perpetua.geometry.pinhole import inside_image, project
from perpetua.geometry.raycast import Caster
from perpetua.geometry.transforms import invert_rigid, transform_points
from perpetua.navigation.config import NavigationConfig
from perpetua.routes.config import RoutesConfig
from perpetua.scene.actor import ActorMesh, Route
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

SUBSTEPS = 4
# Rounding of stored positions and of the libraries that measure them.
SLACK_M = 2e-3
SLACK_FRACTION = 0.01
BODY_POINTS = 24
# An actor is seen where at least half of its head's and torso's points are.
UPPER_BODY = (0.5, 1.0)
SEEN_FRACTION = 0.5


@dataclass(frozen=True)
class MotionLimits:
    """The hard limits that the planners were given."""

    routes: RoutesConfig
    cameras: CamerasConfig
    navigation: NavigationConfig


@dataclass(frozen=True)
class MotionAudit:
    """Hard rules, and curves over the frames: distances hold the least of a frame's four sub-steps.

    ``views_seeing`` counts the views that see an actor; ``apart_rad`` is the angle at an actor between its two most
    different views, over all of them; ``focus_seen`` is 1 where a view sees one of the actors it is to show.
    """

    checks: tuple[Check, ...]
    actor_speed_mps: Float64[np.ndarray, "A T"]
    actor_scene_m: Float64[np.ndarray, "A T"]
    actor_apart_m: Float64[np.ndarray, "A T"]
    views_seeing: Float64[np.ndarray, "A T"]
    apart_rad: Float64[np.ndarray, "A T"]
    focus_seen: Float64[np.ndarray, "C T"]
    camera_speed_mps: Float64[np.ndarray, "C T"]
    camera_turn_radps: Float64[np.ndarray, "C T"]
    camera_scene_m: Float64[np.ndarray, "C T"]
    camera_actor_m: Float64[np.ndarray, "C T"]

    @property
    def passed(self) -> bool:
        """Whether every hard rule is kept."""
        return all(check.passed for check in self.checks)

    def to_json(self) -> dict[str, Any]:
        """Checks, summary and curves as JSON values, curves rounded to four digits."""
        curves = {name: np.round(getattr(self, name), 4).tolist() for name in self.curve_names()}
        return {"passed": self.passed, "checks": [vars(check) for check in self.checks], "curves": curves} | {
            "focus_seen_share": self.focus_seen.mean(axis=1).tolist(),
            "seen_by_two_share": (self.views_seeing >= 2).mean(axis=1).tolist(),
            "mean_apart_deg": float(np.degrees(self.apart_rad.mean())),
        }

    @classmethod
    def curve_names(cls) -> tuple[str, ...]:
        """Names of the curves."""
        return tuple(name for name in cls.__dataclass_fields__ if name != "checks")


def audit_motion(
    room: Room,
    routes: tuple[Route, ...],
    actors: tuple[ActorMesh, ...],
    cameras: tuple[CameraPath, ...],
    focus: Bool[np.ndarray, "C T A"],
    fps: float,
    limits: MotionLimits,
) -> MotionAudit:
    """Measures a sequence's motion against the true triangles.

    Args:
        room: its meshes are the obstacles, except for actors those that are walkable.
        routes: positions of the actors' axes.
        actors: their posed meshes, which cameras keep away from.
        cameras: one path per view.
        focus: the actors that each view should show.
        fps: frames per second.
        limits: the rules.
    """
    positions_m = np.stack([path.world_from_camera[:, :3, 3] for path in cameras])
    axes_m = np.stack([route.position_m for route in routes])
    sight = Caster(join([obj.mesh for obj in room.objects if obj.opaque]))
    seen = np.stack([_seen_by(path, actors, sight) for path in cameras])
    camera_scene_m, camera_actor_m = _camera_distances_m(room, actors, positions_m)
    curves = {
        "actor_speed_mps": _speed(axes_m, fps),
        "actor_scene_m": _pillar_distances_m(room, axes_m, limits.navigation),
        "actor_apart_m": _separation_m(axes_m),
        "views_seeing": seen.sum(axis=0).astype(np.float64),
        "apart_rad": _apart_rad(positions_m, axes_m),
        "focus_seen": (np.moveaxis(seen, 1, 2) & focus).any(axis=2).astype(np.float64),
        "camera_speed_mps": _speed(positions_m, fps),
        "camera_turn_radps": np.stack([_turn_radps(path, fps) for path in cameras]),
        "camera_scene_m": camera_scene_m,
        "camera_actor_m": camera_actor_m,
    }
    return MotionAudit(_checks(curves, limits), **curves)


def _checks(curves: dict[str, Float64[np.ndarray, "_ T"]], limits: MotionLimits) -> tuple[Check, ...]:
    routes, cameras = limits.routes, limits.cameras
    turn_radps = float(np.radians(cameras.max_turn_deg_per_s))
    return (
        _at_least("route clearance", "actor", curves["actor_scene_m"], limits.navigation.body_radius_m),
        _at_least("route separation", "actor", curves["actor_apart_m"], routes.separation_m),
        _at_most("route speed", "actor", curves["actor_speed_mps"], routes.max_speed_mps, "m/s"),
        _at_least("camera to scene", "camera", curves["camera_scene_m"], cameras.scene_clearance_m),
        _at_least("camera to actors", "camera", curves["camera_actor_m"], cameras.actor_clearance_m),
        _at_most("camera speed", "camera", curves["camera_speed_mps"], cameras.max_speed_mps, "m/s"),
        _at_most("camera turning", "camera", curves["camera_turn_radps"], turn_radps, "rad/s"),
    )


def _at_least(name: str, who: str, curve_m: Float64[np.ndarray, "_ T"], limit_m: float) -> Check:
    # Distances are cut at FAR_M, so a larger limit cannot be tested.
    limit_m = min(limit_m, FAR_M)
    index, frame = np.unravel_index(int(curve_m.argmin()), curve_m.shape)
    value_m = float(curve_m[index, frame])
    passed = value_m >= limit_m - SLACK_M
    detail = "" if passed else f"{who} {index} has {value_m:.3f} m at frame {frame}; at least {limit_m:g} m is required"
    return Check(name, passed, value_m, f">= {limit_m:g} m", detail)


def _at_most(name: str, who: str, curve: Float64[np.ndarray, "_ T"], limit: float, unit: str) -> Check:
    index, frame = np.unravel_index(int(curve.argmax()), curve.shape)
    value = float(curve[index, frame])
    passed = value <= limit * (1.0 + SLACK_FRACTION)
    most = f"{limit:.4g} {unit}"
    detail = "" if passed else f"{who} {index} has {value:.3f} {unit} at frame {frame}; at most {most} is allowed"
    return Check(name, passed, value, f"<= {most}", detail)


def _sub_times(frames: int) -> Float64[np.ndarray, " N"]:
    return np.arange((frames - 1) * SUBSTEPS + 1) / SUBSTEPS


def _between(way_m: Float64[np.ndarray, "T 3"], time: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, "N 3"]:
    return np.stack([np.interp(time, np.arange(len(way_m)), way_m[:, axis]) for axis in range(3)], axis=1)


def _least_per_frame(values: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " T"]:
    """The least value of each frame and its sub-steps before the next frame; the last frame has no sub-steps."""
    return np.append(values[:-1].reshape(-1, SUBSTEPS).min(axis=1), values[-1])


def _pillar_distances_m(
    room: Room, axes_m: Float64[np.ndarray, "A T 3"], navigation: NavigationConfig
) -> Float64[np.ndarray, "A T"]:
    obstacles = join([obj.mesh for obj in room.objects if not obj.walkable])
    time = _sub_times(axes_m.shape[1])
    low_m, high_m = navigation.step_m, navigation.body_height_m
    return np.stack(
        [_least_per_frame(pillars_to_mesh_m(_between(way_m, time), low_m, high_m, obstacles)) for way_m in axes_m]
    )


def _separation_m(axes_m: Float64[np.ndarray, "A T 3"]) -> Float64[np.ndarray, "A T"]:
    """Distance across the floor to the nearest other actor."""
    time = _sub_times(axes_m.shape[1])
    fine_m = np.stack([_between(way_m, time)[:, :2] for way_m in axes_m])
    apart_m = np.linalg.norm(fine_m[:, None] - fine_m[None], axis=3)
    apart_m[np.arange(len(axes_m)), np.arange(len(axes_m))] = np.inf
    nearest_m = np.minimum(apart_m.min(axis=1), 100.0)
    return np.stack([_least_per_frame(values) for values in nearest_m])


def _camera_distances_m(
    room: Room, actors: tuple[ActorMesh, ...], positions_m: Float64[np.ndarray, "C T 3"]
) -> tuple[Float64[np.ndarray, "C T"], Float64[np.ndarray, "C T"]]:
    scene = join([obj.mesh for obj in room.objects])
    time = _sub_times(positions_m.shape[1])
    points_m = np.concatenate([_between(way_m, time) for way_m in positions_m])
    to_scene_m = points_to_mesh_m(points_m, scene).reshape(len(positions_m), -1)
    times = np.tile(time, len(positions_m))
    to_each_m = [points_to_moving_mesh_m(points_m, times, actor.vertices_m, actor.faces) for actor in actors]
    to_actors_m = np.min(to_each_m, axis=0).reshape(len(positions_m), -1)
    return (
        np.stack([_least_per_frame(values) for values in to_scene_m]),
        np.stack([_least_per_frame(values) for values in to_actors_m]),
    )


def _speed(ways_m: Float64[np.ndarray, "_ T 3"], fps: float) -> Float64[np.ndarray, "_ T"]:
    """Metres per second towards the next frame; the last value is held."""
    speed = np.linalg.norm(np.diff(ways_m, axis=1), axis=2) * fps
    return np.concatenate([speed, speed[:, -1:]], axis=1)


def _turn_radps(path: CameraPath, fps: float) -> Float64[np.ndarray, " T"]:
    rotation = path.world_from_camera[:, :3, :3]
    trace = np.einsum("tij,tij->t", rotation[1:], rotation[:-1])
    turn = np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)) * fps
    return np.append(turn, turn[-1])


def _apart_rad(
    positions_m: Float64[np.ndarray, "C T 3"], axes_m: Float64[np.ndarray, "A T 3"]
) -> Float64[np.ndarray, "A T"]:
    """The largest angle across the floor between two views of each actor."""
    offset = positions_m[None, :, :, :2] - axes_m[:, None, :, :2]
    unit = offset / np.maximum(np.linalg.norm(offset, axis=3, keepdims=True), 1e-9)
    cosine = np.einsum("acti,adti->acdt", unit, unit).min(axis=(1, 2))
    return np.arccos(np.clip(cosine, -1.0, 1.0))


def _seen_by(path: CameraPath, actors: tuple[ActorMesh, ...], caster: Caster) -> Bool[np.ndarray, "A T"]:
    """Where a view has half of an actor's head's and torso's points in its image with nothing of the room between."""
    return np.stack([_seen_fraction(path, _upper_body_m(actor), caster) >= SEEN_FRACTION for actor in actors])


def _upper_body_m(actor: ActorMesh) -> Float64[np.ndarray, "T N 3"]:
    height_m = actor.vertices_m[0, :, 2]
    level = (height_m - height_m.min()) / max(float(np.ptp(height_m)), 1e-6)
    upper = np.flatnonzero((level > UPPER_BODY[0]) & (level <= UPPER_BODY[1]))
    chosen = upper[np.linspace(0, len(upper) - 1, BODY_POINTS).astype(int)]
    return actor.vertices_m[:, chosen].astype(np.float64)


def _seen_fraction(
    path: CameraPath, points_m: Float64[np.ndarray, "T N 3"], caster: Caster
) -> Float64[np.ndarray, " T"]:
    in_camera_m = transform_points(invert_rigid(path.world_from_camera), points_m)
    seen = inside_image(path.intrinsics, project(path.intrinsics, in_camera_m))
    eyes_m = np.broadcast_to(path.world_from_camera[:, None, :3, 3], points_m.shape)
    seen[seen] = caster.clear(eyes_m[seen], points_m[seen])
    return np.asarray(seen.mean(axis=1), np.float64)
