"""Pelvis, spine and head: sway over the standing foot, counter-rotation, lean and gaze."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.actors.motion.actions import Performance
from perpetua.actors.motion.path import RoutePath
from perpetua.actors.motion.rotations import about_x, about_y, about_z, blend
from perpetua.actors.motion.style import GaitStyle


@dataclass(frozen=True)
class Trunk:
    """Trunk over time; ``pelvis_xy_m`` in the world, rotations global."""

    heading_rad: Float64[np.ndarray, " N"]
    stillness: Float64[np.ndarray, " N"]
    pelvis_xy_m: Float64[np.ndarray, "N 2"]
    world_from_pelvis: Float64[np.ndarray, "N 3 3"]
    world_from_chest: Float64[np.ndarray, "N 3 3"]
    world_from_head: Float64[np.ndarray, "N 3 3"]


def make_trunk(
    path: RoutePath,
    style: GaitStyle,
    performance: Performance,
    left_on_floor: Bool[np.ndarray, " N"],
    right_on_floor: Bool[np.ndarray, " N"],
    left_lead_m: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Trunk:
    """The trunk at evenly spaced times.

    Args:
        path: the route.
        style: personal habits.
        performance: what the upper body does.
        left_on_floor: whether the left foot stands.
        right_on_floor: whether the right foot stands.
        left_lead_m: how far the left foot is ahead of the right along the heading.
        time_s: evenly spaced times.
    """
    per_second = 1.0 / (time_s[1] - time_s[0])
    heading_rad = path.heading_rad(time_s)
    speed_mps = path.speed_mps(time_s)
    stillness = gaussian_filter1d(
        1.0 - np.clip((speed_mps + 0.3 * path.turn_rps(time_s)) / 0.25, 0.0, 1.0), 0.3 * per_second
    )
    idle = _idle_shift(style, time_s)
    # From -1 (weight on the right foot) to 1 (on the left).
    load = left_on_floor.astype(np.float64) - right_on_floor.astype(np.float64)
    load = gaussian_filter1d(load, 0.13 * per_second) + 0.7 * stillness * idle
    pace = np.clip(speed_mps / 1.2, 0.0, 1.0)
    sway_m = load * (style.sway_m + 0.014 * (1.0 - pace))
    pelvis_xy_m = path.position_m(time_s)[:, :2] + sway_m[:, None] * np.stack(
        [-np.sin(heading_rad), np.cos(heading_rad)], axis=1
    )
    turn_rad = style.pelvis_turn_rad_per_m * gaussian_filter1d(left_lead_m, 0.04 * per_second)
    list_rad = style.pelvis_list_rad * load
    push = gaussian_filter1d(path.forward_acceleration_mps2(time_s), 0.2 * per_second)
    lean_rad = style.lean_rad + performance.lean_rad + 0.03 * pace + np.clip(0.03 * push, -0.08, 0.1)
    breath_rad = 0.006 * np.sin(2.0 * np.pi * time_s / 3.6 + style.idle_phase[2])
    world_from_pelvis = about_z(heading_rad - turn_rad) @ about_y(0.5 * lean_rad) @ about_x(list_rad)
    world_from_chest = (
        about_z(heading_rad + turn_rad + 0.05 * stillness * idle)
        @ about_y(lean_rad + breath_rad)
        @ about_x(-0.3 * list_rad)
    )
    return Trunk(
        heading_rad,
        stillness,
        pelvis_xy_m,
        world_from_pelvis,
        world_from_chest,
        _head(path, style, performance, heading_rad, stillness, time_s),
    )


def spine_between(
    world_from_pelvis: Float64[np.ndarray, "N 3 3"], world_from_chest: Float64[np.ndarray, "N 3 3"]
) -> tuple[Float64[np.ndarray, "N 3 3"], Float64[np.ndarray, "N 3 3"]]:
    """The two lower joints of the spine, between the pelvis and the chest (the third)."""
    return blend(world_from_pelvis, world_from_chest, 0.33), blend(world_from_pelvis, world_from_chest, 0.67)


def _idle_shift(style: GaitStyle, time_s: Float64[np.ndarray, " N"]) -> Float64[np.ndarray, " N"]:
    """Slow change between the feet: people rest on one leg for some seconds, then on the other."""
    waves = sum(
        np.sin(2.0 * np.pi * time_s / period_s + phase)
        for period_s, phase in zip(style.idle_period_s[:2], style.idle_phase[:2], strict=True)
    )
    return np.asarray(np.tanh(1.5 * waves))


def _head(
    path: RoutePath,
    style: GaitStyle,
    performance: Performance,
    heading_rad: Float64[np.ndarray, " N"],
    stillness: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, "N 3 3"]:
    """Level, and turned to where the body will be heading shortly."""
    first_s, second_s, third_s = style.idle_period_s
    first, second, third = style.idle_phase
    wander = 0.6 * np.sin(2.0 * np.pi * time_s / (0.6 * first_s) + second)
    wander += 0.4 * np.sin(2.0 * np.pi * time_s / (0.37 * second_s) + third)
    ahead_rad = np.clip(path.heading_rad(time_s + 0.45) - heading_rad, -0.9, 0.9)
    yaw_rad = heading_rad + ahead_rad + performance.gaze_wander_rad * (1.0 + 0.8 * stillness) * np.tanh(1.5 * wander)
    nod_rad = 0.02 * np.sin(2.0 * np.pi * time_s / (0.5 * third_s) + first)
    pitch_rad = style.gaze_pitch_rad + performance.gaze_pitch_rad + nod_rad
    return np.asarray(about_z(yaw_rad) @ about_y(pitch_rad))
