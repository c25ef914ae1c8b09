"""Swinging feet led round what stands on the floor: a toe lifted in a turn must not go through a sofa's foot."""

from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.raycast import Caster
from perpetua.motion.feet import FootShape, FootTrack
from perpetua.motion.rotations import about_y, about_z, rotate, smoothstep
from perpetua.scene.room import Room

# Feet keep this far from things, measured from the middle of the foot's outline points.
_KEEP_M = 0.055
# Only what is so low, and so near to the way, can be met.
_LOW_M, _HIGH_M, _AROUND_M = 0.025, 0.6, 0.7
_FARTHEST_M = 0.14
_PASSES = 3
# Shares of a swing in which a foot leaves its line and comes back to it.
_LEAVE_FRACTION = 0.3


def low_obstacles(room: Room, way_m: Float64[np.ndarray, "T 3"]) -> Caster:
    """Triangles that feet on a way could meet."""
    floor_m = float(way_m[:, 2].min())
    low = np.append(way_m[:, :2].min(0) - _AROUND_M, floor_m + _LOW_M)
    high = np.append(way_m[:, :2].max(0) + _AROUND_M, floor_m + _HIGH_M)
    kept = [np.zeros((0, 3, 3))]
    for obj in room.objects:
        if obj.walkable or len(obj.mesh.faces) == 0:
            continue
        corners_m = obj.mesh.vertices_m[obj.mesh.faces]
        kept.append(corners_m[np.all((corners_m.max(1) > low) & (corners_m.min(1) < high), axis=1)])
    soup_m = np.concatenate(kept)
    return Caster(TriMesh(soup_m.reshape(-1, 3), np.arange(3 * len(soup_m), dtype=np.int32).reshape(-1, 3)))


def steered(track: FootTrack, shape: FootShape, obstacles: Caster) -> FootTrack:
    """The track with swings bent aside where the foot would meet something; feet that stand stay."""
    window = _swing_window(~track.on_floor)
    for _ in range(_PASSES):
        push_m = _push_m(track, shape, obstacles) * (window > 0.0)[:, None]
        if not push_m.any():
            return track
        # The largest push around each moment, so that a foot is aside before it gets there.
        size_m = np.linalg.norm(push_m, axis=1)
        wide_m = maximum_filter1d(size_m, 9, mode="nearest")
        soft = np.stack([gaussian_filter1d(push_m[:, axis], 4.0, mode="nearest") for axis in (0, 1)], axis=1)
        direction = soft / np.maximum(np.linalg.norm(soft, axis=1, keepdims=True), 1e-9)
        bend_m = gaussian_filter1d(np.minimum(wide_m, _FARTHEST_M), 3.0, mode="nearest") * window
        track = replace(track, ankle_m=track.ankle_m + np.column_stack([bend_m[:, None] * direction, 0.0 * bend_m]))
    return track


def _swing_window(swings: Bool[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """1 in the middle of each swing, 0 while standing."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], swings, [False]]).astype(int)))
    window = np.zeros(len(swings))
    for start, end in edges.reshape(-1, 2):
        fraction = (np.arange(start, end) - start + 0.5) / (end - start)
        window[start:end] = smoothstep(fraction / _LEAVE_FRACTION) * smoothstep((1.0 - fraction) / _LEAVE_FRACTION)
    return window


def _push_m(track: FootTrack, shape: FootShape, obstacles: Caster) -> Float64[np.ndarray, "N 2"]:
    """Which way, and how far, a foot must go at each moment to be clear of everything."""
    foot = about_z(track.yaw_rad) @ about_y(track.pitch_rad)
    toes = about_z(track.yaw_rad) @ about_y(track.toe_pitch_rad)
    ball_m = track.ankle_m + rotate(foot, shape.toe_joint_m)
    tip_m = ball_m + rotate(toes, 1.5 * (shape.toe_m - shape.toe_joint_m))
    push_m = np.zeros((len(track.yaw_rad), 2))
    for point_m in (track.ankle_m, ball_m, tip_m, track.ankle_m + rotate(foot, shape.heel_m)):
        one_m = _away_from(track.ankle_m, point_m, obstacles)
        larger = np.linalg.norm(one_m, axis=1) > np.linalg.norm(push_m, axis=1)
        push_m = np.where(larger[:, None], one_m, push_m)
    return push_m


def _away_from(
    inside_m: Float64[np.ndarray, "N 3"], point_m: Float64[np.ndarray, "N 3"], obstacles: Caster
) -> Float64[np.ndarray, "N 2"]:
    closest_m = obstacles.closest_point(point_m, _KEEP_M)
    gap_m = np.nan_to_num(point_m - closest_m)[:, :2]
    distance_m = np.linalg.norm(np.nan_to_num(point_m - closest_m), axis=1, keepdims=True)
    near = np.isfinite(closest_m[:, :1]) & (distance_m > 1e-6)
    away_m = np.where(near, gap_m / np.maximum(distance_m, 1e-6) * (_KEEP_M - distance_m), 0.0)
    offset_m = point_m - inside_m
    length_m = np.linalg.norm(offset_m, axis=1)
    moved = length_m > 1e-6
    hits = obstacles.first_hit(inside_m, np.where(moved[:, None], offset_m, [0.0, 0.0, -1.0]))
    through = hits.hit & moved & (hits.distance_m < length_m)
    beyond = np.where(through, (length_m - hits.distance_m + _KEEP_M) / np.maximum(length_m, 1e-6), 0.0)
    return np.where(through[:, None], -beyond[:, None] * offset_m[:, :2], away_m)
