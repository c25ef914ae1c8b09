"""Pelvis, spine and head: sway over the standing foot, counter-rotation, lean and gaze."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.action_timeline import ActionTimeline
from perpetua.motion.feet import FootTrack
from perpetua.motion.gaze import Gaze
from perpetua.motion.path import RoutePath
from perpetua.motion.rotations import about_x, about_y, about_z, blend
from perpetua.motion.style import GaitStyle

_RUN_LEAN_RAD = 0.1
# The pelvis takes this fraction of the trunk's lean, and the chest of a turn of the eyes.
_PELVIS_LEAN, _CHEST_FOLLOWS = 0.5, 0.35


@dataclass(frozen=True)
class Trunk:
    """Trunk over time; ``pelvis_xy_m`` in the world, rotations global."""

    heading_rad: Float64[np.ndarray, " N"]
    pelvis_xy_m: Float64[np.ndarray, "N 2"]
    world_from_pelvis: Float64[np.ndarray, "N 3 3"]
    world_from_chest: Float64[np.ndarray, "N 3 3"]
    world_from_head: Float64[np.ndarray, "N 3 3"]


@dataclass(frozen=True)
class Poise:
    """What the trunk answers to besides the legs: actions, things of interest, and a seat.

    ``lean_rad`` and ``tilt_rad`` are of a sitting body, ``seated`` goes from 0 (on the feet) to 1.
    """

    timeline: ActionTimeline
    gaze: Gaze
    seated: Float64[np.ndarray, " N"]
    lean_rad: Float64[np.ndarray, " N"]
    tilt_rad: Float64[np.ndarray, " N"]


def make_trunk(
    path: RoutePath,
    style: GaitStyle,
    poise: Poise,
    feet: tuple[FootTrack, FootTrack],
    left_lead_m: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Trunk:
    """The trunk at evenly spaced times.

    Args:
        path: the route.
        style: personal habits.
        poise: what else it answers to.
        feet: left and right.
        left_lead_m: how far the left foot is ahead of the right along the heading.
        time_s: evenly spaced times.
    """
    gait = _sampled(path, style, poise, feet, time_s)
    left = np.stack([-np.sin(gait.heading_rad), np.cos(gait.heading_rad)], axis=1)
    pelvis_xy_m = path.position_m(time_s)[:, :2] + _sway_m(gait, style, poise)[:, None] * left
    turn_rad = style.pelvis_turn_rad_per_m * gaussian_filter1d(left_lead_m, 0.04 * gait.per_second)
    list_rad = style.pelvis_list_rad * gait.load
    lean_rad = _lean_rad(path, gait, style, poise, time_s)
    world_from_pelvis = (
        about_z(gait.heading_rad - turn_rad) @ about_y(_PELVIS_LEAN * lean_rad + poise.tilt_rad) @ about_x(list_rad)
    )
    breath_rad = 0.006 * np.sin(2.0 * np.pi * time_s / 3.6 + style.idle_phase[2])
    chest_turn_rad = turn_rad + 0.05 * gait.stillness * gait.idle + poise.timeline.turn_rad
    chest_turn_rad += np.clip(_CHEST_FOLLOWS * poise.gaze.weight * poise.gaze.yaw_rad, -0.5, 0.5)
    world_from_chest = (
        about_z(gait.heading_rad + chest_turn_rad)
        @ about_y(lean_rad + breath_rad)
        @ about_x(-0.3 * list_rad + poise.timeline.sway_rad)
    )
    head = _head(path, style, poise, gait.heading_rad, gait.stillness, time_s)
    return Trunk(gait.heading_rad, pelvis_xy_m, world_from_pelvis, world_from_chest, head)


@dataclass(frozen=True)
class _Gait:
    """The route and the feet at evenly spaced times, ``per_second`` of them.

    ``run`` is the weight of running; ``load`` goes from -1 (weight on the right foot) to 1 (on the left); ``idle`` is
    the slow change between the feet of a standing body.
    """

    per_second: float
    heading_rad: Float64[np.ndarray, " N"]
    run: Float64[np.ndarray, " N"]
    stillness: Float64[np.ndarray, " N"]
    idle: Float64[np.ndarray, " N"]
    load: Float64[np.ndarray, " N"]
    pace: Float64[np.ndarray, " N"]


def _sampled(
    path: RoutePath,
    style: GaitStyle,
    poise: Poise,
    feet: tuple[FootTrack, FootTrack],
    time_s: Float64[np.ndarray, " N"],
) -> _Gait:
    per_second = 1.0 / (time_s[1] - time_s[0])
    stillness = path.stillness(time_s)
    idle = _idle_shift(style, time_s) * (1.0 - poise.seated)
    load = feet[0].on_floor.astype(np.float64) - feet[1].on_floor.astype(np.float64)
    load = gaussian_filter1d(load, 0.13 * per_second) + 0.7 * stillness * idle
    pace = np.clip(path.speed_mps(time_s) / 1.2, 0.0, 1.0)
    return _Gait(per_second, path.heading_rad(time_s), path.run_weight(time_s), stillness, idle, load, pace)


def _sway_m(gait: _Gait, style: GaitStyle, poise: Poise) -> Float64[np.ndarray, " N"]:
    """How far the pelvis is to the left, over the standing foot."""
    sway_m = gait.load * (style.sway_m + 0.014 * (1.0 - gait.pace)) * (1.0 - 0.5 * gait.run)
    return sway_m + 0.25 * poise.timeline.sway_rad


def _lean_rad(
    path: RoutePath, gait: _Gait, style: GaitStyle, poise: Poise, time_s: Float64[np.ndarray, " N"]
) -> Float64[np.ndarray, " N"]:
    """The trunk's lean forward: with the pace, into a push, as a seat or an action asks."""
    push = gaussian_filter1d(path.forward_acceleration_mps2(time_s), 0.2 * gait.per_second)
    lean_rad = style.lean_rad + 0.03 * gait.pace + _RUN_LEAN_RAD * gait.run + np.clip(0.03 * push, -0.08, 0.1)
    return np.asarray(lean_rad * (1.0 - poise.seated) + poise.lean_rad + poise.timeline.lean_rad)


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
    poise: Poise,
    heading_rad: Float64[np.ndarray, " N"],
    stillness: Float64[np.ndarray, " N"],
    time_s: Float64[np.ndarray, " N"],
) -> Float64[np.ndarray, "N 3 3"]:
    """Level, and turned to what is looked at, or to where the body will be heading shortly."""
    timeline, gaze = poise.timeline, poise.gaze
    first_s, second_s, third_s = style.idle_period_s
    first, second, third = style.idle_phase
    wander = 0.6 * np.sin(2.0 * np.pi * time_s / (0.6 * first_s) + second)
    wander += 0.4 * np.sin(2.0 * np.pi * time_s / (0.37 * second_s) + third)
    ahead_rad = np.clip(path.heading_rad(time_s + 0.45) - heading_rad, -0.9, 0.9)
    idle_rad = ahead_rad + timeline.wander_rad * (1.0 + 0.8 * stillness) * np.tanh(1.5 * wander)
    nod_rad = 0.02 * np.sin(2.0 * np.pi * time_s / (0.5 * third_s) + first)
    yaw_rad = idle_rad + gaze.weight * (gaze.yaw_rad + 0.25 * idle_rad - idle_rad) + timeline.head_turn_rad
    pitch_rad = style.gaze_pitch_rad + gaze.weight * (gaze.pitch_rad - style.gaze_pitch_rad) + timeline.head_pitch_rad
    # A head follows a trunk that bows or leans back, and no neck turns farther than this.
    pitch_rad += nod_rad + 0.75 * np.maximum(timeline.lean_rad, 0.0) + 0.4 * np.maximum(poise.lean_rad, 0.0)
    yaw_rad = heading_rad + np.clip(yaw_rad, -1.3, 1.3)
    return np.asarray(about_z(yaw_rad) @ about_y(pitch_rad) @ about_x(timeline.head_tilt_rad))
