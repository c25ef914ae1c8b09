"""Where to look at a room from: from above with its ceiling cut off, and from two opposite corners."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.raycast import Caster
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room

TOP, FIRST_CORNER, SECOND_CORNER = 0, 1, 2
WIDTH_PX, HEIGHT_PX = 384, 288
# From far above, so that walls hide little; what is higher than this share of the room is cut off.
TOP_FOV_RAD, CUT_FRACTION = math.radians(28.0), 0.92
# Walls stand around the floor, and some space around the walls.
TOP_MARGIN_M = 0.35
CORNER_FOV_RAD = math.radians(82.0)
EYE_M = 1.6
# Places tried on the way from a corner to the middle, as shares of it, and heights above the floor.
CORNER_STEPS = (0.06, 0.1, 0.15, 0.2, 0.27, 0.35)
EYE_RISES_M = (0.0, 0.35)
CLEARANCE_M = 0.25
# A view is as good as it is free: rays so far count no more.
FAR_M = 4.0
RAYS = 15


@dataclass(frozen=True)
class RoomViews:
    """Three cameras that stand still for one frame, and where the cutaway from above begins (depth, metres)."""

    cameras: tuple[CameraPath, CameraPath, CameraPath]
    top_near_m: float


def place_views(room: Room) -> RoomViews:
    """A view from above and two from opposite corners at eye height, where furniture does not block them."""
    top, near_m = _from_above(room)
    caster = room.surfaces.caster
    low_m, high_m = room.floor_polygon_m.min(0), room.floor_polygon_m.max(0)
    diagonals = [
        (np.array([low_m[0], low_m[1]]), np.array([high_m[0], high_m[1]])),
        (np.array([low_m[0], high_m[1]]), np.array([high_m[0], low_m[1]])),
    ]
    choices = []
    for pair in diagonals:
        eyes = [_best_eye(room, caster, corner_m) for corner_m in pair]
        choices.append((min(openness for openness, _ in eyes), eyes))
    _, eyes = max(choices, key=lambda choice: choice[0])
    first, second = (
        _still(number, pose, Intrinsics.centred(WIDTH_PX, HEIGHT_PX, CORNER_FOV_RAD))
        for number, (_, pose) in zip((FIRST_CORNER, SECOND_CORNER), eyes, strict=True)
    )
    return RoomViews((top, first, second), near_m)


def _from_above(room: Room) -> tuple[CameraPath, float]:
    """The whole floor with its walls, longer side across; and the depth of the cut."""
    low_m, high_m = room.floor_polygon_m.min(0), room.floor_polygon_m.max(0)
    sides_m = high_m - low_m + 2.0 * TOP_MARGIN_M
    across = 0 if sides_m[0] >= sides_m[1] else 1
    intrinsics = Intrinsics.centred(WIDTH_PX, HEIGHT_PX, TOP_FOV_RAD)
    half_m = 0.5 * np.array([sides_m[across], sides_m[1 - across]])
    half_px = 0.5 * np.array([WIDTH_PX, HEIGHT_PX])
    cut_m = CUT_FRACTION * room.height_m
    distance_m = float((half_m * intrinsics.fx_px / half_px).max())
    right = np.eye(3)[across]
    forward = np.array([0.0, 0.0, -1.0])
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = [*(0.5 * (low_m + high_m)), cut_m + distance_m]
    return _still(TOP, pose, intrinsics), distance_m


def _best_eye(
    room: Room, caster: Caster, corner_m: Float64[np.ndarray, "2"]
) -> tuple[float, Float64[np.ndarray, "4 4"]]:
    """The pose near a corner that sees most of the room, and how much it sees: mean length of its rays, metres."""
    best = (-1.0, np.eye(4))
    for step in CORNER_STEPS:
        for rise_m in EYE_RISES_M:
            height_m = min(EYE_M + rise_m, room.height_m - 0.5)
            eye_m = np.array([*(corner_m * (1.0 - step)), height_m])
            if caster.closest_distance(eye_m[None], CLEARANCE_M)[0] < CLEARANCE_M:
                continue
            pose = _looking_at(eye_m, np.array([*(-0.35 * corner_m), 0.35 * room.height_m]))
            openness_m = _openness_m(caster, pose)
            # Further back is better where two places see as much.
            if openness_m > best[0] + 0.1:
                best = (openness_m, pose)
    if best[0] < 0.0:
        return 0.0, _looking_at(np.array([*(0.5 * corner_m), EYE_M]), np.array([*(-0.5 * corner_m), 1.0]))
    return best


def _openness_m(caster: Caster, pose: Float64[np.ndarray, "4 4"]) -> float:
    intrinsics = Intrinsics.centred(RAYS, RAYS, CORNER_FOV_RAD)
    u, v = np.meshgrid(np.arange(RAYS), np.arange(RAYS))
    rays = np.stack([(u - intrinsics.cx_px) / intrinsics.fx_px, (v - intrinsics.cy_px) / intrinsics.fy_px], axis=-1)
    directions = np.concatenate([rays.reshape(-1, 2), np.ones((RAYS * RAYS, 1))], axis=1) @ pose[:3, :3].T
    hits = caster.first_hit(np.tile(pose[:3, 3], (len(directions), 1)), np.ascontiguousarray(directions))
    return float(np.minimum(hits.distance_m, FAR_M).mean())


def _looking_at(eye_m: Float64[np.ndarray, "3"], target_m: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "4 4"]:
    forward = (target_m - eye_m) / np.linalg.norm(target_m - eye_m)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([right, np.cross(forward, right), forward], axis=1)
    pose[:3, 3] = eye_m
    return pose


def _still(number: int, pose: Float64[np.ndarray, "4 4"], intrinsics: Intrinsics) -> CameraPath:
    return CameraPath(number, pose[None], intrinsics)
