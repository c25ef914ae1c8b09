"""Full-body motion from rules: footsteps, locked feet, legs by inverse kinematics, a trunk and arms that follow.

Everything is planned as functions of time and evaluated on a fine grid that holds the frames, so any frame rate works.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.motion.action_timeline import ActionTimeline, TimedAction, draw_timeline
from perpetua.motion.actions import DescribedMotion, read_description
from perpetua.motion.clock import Clock, make_clock
from perpetua.motion.config import MotionConfig
from perpetua.motion.feet import FootTrack, foot_track
from perpetua.motion.footsteps import FootstepPlanner, Plant
from perpetua.motion.gaze import aim_m, aim_weight, dwell_gaze
from perpetua.motion.gesturing import Limbs, make_arm, make_fingers, wrist_from
from perpetua.motion.ground import Ground
from perpetua.motion.hip_height import nominal_height_m
from perpetua.motion.kinematics import bone, joint_index
from perpetua.motion.legs import SIDES, foot_of, leg_of, pelvis_heights_m, solve_leg
from perpetua.motion.path import RoutePath
from perpetua.motion.rotations import about_y, about_z, blend, rotate
from perpetua.motion.sitting import Sitting, plan_sittings, without_failed_sits
from perpetua.motion.sitting_motion import (
    lowered_pelvis,
    pelvis_tilt_rad,
    raised_heels,
    seated_weight,
    sitting_lean_rad,
    stepped_back,
)
from perpetua.motion.style import GaitStyle, draw_gait_style
from perpetua.motion.swing_avoidance import low_obstacles, steered
from perpetua.motion.trunk import Poise, Trunk, make_trunk, spine_between
from perpetua.scene.actor import BODY_JOINTS, BodyMotion, Route, Skeleton
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

_TAKEN_ALONG_M, _RUNNING_FORESIGHT_S = 0.12, 0.03
# From the thigh's bone up to a wrist that rests on it, and how far along the thigh.
_WRIST_OVER_THIGH_M, _ALONG_THIGH = 0.105, 0.62

Rotations = dict[str, Float64[np.ndarray, "N 3 3"]]


@dataclass(frozen=True)
class _Walker:
    """Who moves, how, and where."""

    skeleton: Skeleton
    style: GaitStyle
    described: DescribedMotion
    route: Route
    path: RoutePath
    sittings: tuple[Sitting, ...]
    room: Room


@dataclass(frozen=True)
class _Stride:
    """Both feet, left and right: where they stand when, and all that lies between."""

    plants: tuple[tuple[Plant, ...], tuple[Plant, ...]]
    tracks: tuple[FootTrack, FootTrack]


class ProceduralMotion:
    """Walks, jogs, turns, stands and sits along any route, with arms, trunk and head moved by words."""

    def check(self, config: MotionConfig) -> None:
        """Nothing is needed."""

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """See ``MotionSource.make``."""
        walker = _walker(route, skeleton, room, fps, seed)
        clock = make_clock(len(route.heading_rad), fps)
        stride = _stride(walker, seed.stream("steps", route.actor), clock)
        timeline = _timeline(walker, seed.stream("actions", route.actor), clock)
        trunk = _trunk(walker, stride, timeline, clock)
        pelvis_m = _pelvis_m(walker, trunk, stride, timeline, clock)
        rotations = _trunk_rotations(trunk)
        reached = [
            _enter_leg(rotations, side, walker, track, pelvis_m, trunk)
            for side, track in zip(SIDES, stride.tracks, strict=True)
        ]
        actions = (_action_of(timeline, SIDES[0]), _action_of(timeline, SIDES[1]))
        for side, timed in zip(SIDES, actions, strict=True):
            _enter_arm(rotations, side, walker, pelvis_m, stride, timeline, timed, clock)
        at = clock.at_frames
        world_from_joint = np.stack([rotations[name] for name in BODY_JOINTS], axis=1)
        fingers = make_fingers(actions[0], actions[1], walker.path.run_weight(clock.time_s))
        return BodyMotion(
            route.actor,
            fps,
            np.ascontiguousarray(world_from_joint[at]),
            np.ascontiguousarray(pelvis_m[at]),
            np.ascontiguousarray(_contacts(stride, reached)[at]),
            np.ascontiguousarray(fingers[at]),
        )


def _walker(route: Route, skeleton: Skeleton, room: Room, fps: float, seed: StageSeed) -> _Walker:
    hip_m = bone(skeleton, "right_hip", "left_hip")
    style = draw_gait_style(seed.stream("style", route.actor), 0.5 * float(hip_m[1]))
    sittings = plan_sittings(route, skeleton, room, fps)
    told = without_failed_sits(route, sittings, fps)
    path = RoutePath(stepped_back(told, sittings, fps), fps)
    return _Walker(skeleton, style, read_description(route.description), told, path, sittings, room)


def _stride(walker: _Walker, rng: np.random.Generator, clock: Clock) -> _Stride:
    left, right = (foot_of(walker.skeleton, side) for side in SIDES)
    leg = leg_of(walker.skeleton, "left")
    hip_height_m = float(left.ankle_height_m - (leg.thigh_m + leg.shin_m)[2])
    ankle_ahead_m = float(bone(walker.skeleton, "pelvis", "left_ankle")[0])
    ground = Ground(walker.room)
    planner = FootstepPlanner(walker.path, walker.style, hip_height_m, ankle_ahead_m, ground, rng)
    plants = planner.plan()
    obstacles = low_obstacles(walker.room, walker.path.position_m(clock.time_s))
    tracks = []
    for steps, foot in zip(plants, (left, right), strict=True):
        track = steered(foot_track(steps, foot, walker.style.clearance_m, ground, clock.time_s), foot, obstacles)
        tracks.append(raised_heels(track, walker.sittings, foot.toe_joint_m, clock.time_s))
    return _Stride(plants, (tracks[0], tracks[1]))


def _timeline(walker: _Walker, rng: np.random.Generator, clock: Clock) -> ActionTimeline:
    return draw_timeline(
        walker.described,
        walker.path.stillness(clock.time_s),
        seated_weight(walker.sittings, clock.time_s),
        clock.time_s,
        rng,
    )


def _trunk(walker: _Walker, stride: _Stride, timeline: ActionTimeline, clock: Clock) -> Trunk:
    time_s = clock.time_s
    eye_m = _eye_m(walker, clock)
    poise = Poise(
        timeline,
        dwell_gaze(walker.route, clock.fps, eye_m, walker.path.heading_rad(time_s), time_s),
        seated_weight(walker.sittings, time_s),
        sitting_lean_rad(walker.sittings, time_s),
        pelvis_tilt_rad(walker.sittings, time_s),
    )
    lead_m = _lead_m(walker, stride.tracks[0], stride.tracks[1], clock)
    return make_trunk(walker.path, walker.style, poise, stride.tracks, lead_m, time_s)


def _eye_m(walker: _Walker, clock: Clock) -> Float64[np.ndarray, "N 3"]:
    head_m = float(walker.skeleton.joint_m[joint_index("head"), 2] - walker.skeleton.contact_m[:, 2].min())
    return walker.path.position_m(clock.time_s) + np.array([0.0, 0.0, head_m + 0.06])


def _lead_m(walker: _Walker, foot: FootTrack, other: FootTrack, clock: Clock) -> Float64[np.ndarray, " N"]:
    """How far a foot is ahead of the other along the heading."""
    heading_rad = walker.path.heading_rad(clock.time_s)
    apart_m = foot.ankle_m - other.ankle_m
    return np.asarray(apart_m[:, 0] * np.cos(heading_rad) + apart_m[:, 1] * np.sin(heading_rad))


def _pelvis_m(
    walker: _Walker, trunk: Trunk, stride: _Stride, timeline: ActionTimeline, clock: Clock
) -> Float64[np.ndarray, "N 3"]:
    legs = (leg_of(walker.skeleton, "left"), leg_of(walker.skeleton, "right"))
    standing_m = nominal_height_m(
        walker.path, walker.skeleton, stride.plants, legs[0].reach_m, timeline.drop, clock.time_s
    )
    pelvis_m = np.column_stack([trunk.pelvis_xy_m, standing_m])
    pelvis_m = lowered_pelvis(walker.sittings, pelvis_m, trunk.world_from_pelvis, walker.skeleton, clock.time_s)
    ankles_m = (stride.tracks[0].ankle_m, stride.tracks[1].ankle_m)
    reaching = (pelvis_m[:, 2], pelvis_m[:, :2], trunk.world_from_pelvis, legs, ankles_m, clock.step_s)
    height_m = pelvis_heights_m(*reaching)
    run = walker.path.run_weight(clock.time_s)
    if run.any():
        # Runners bounce faster than walkers ease their hips down, and their feet in the air are taken along.
        slack_m = (_TAKEN_ALONG_M * run * ~stride.tracks[0].on_floor, _TAKEN_ALONG_M * run * ~stride.tracks[1].on_floor)
        bouncing_m = pelvis_heights_m(*reaching, slack_m, _RUNNING_FORESIGHT_S)
        height_m = height_m + run * (bouncing_m - height_m)
    pelvis_m[:, 2] = height_m
    return pelvis_m


def _trunk_rotations(trunk: Trunk) -> Rotations:
    lower, middle = spine_between(trunk.world_from_pelvis, trunk.world_from_chest)
    return {
        "pelvis": trunk.world_from_pelvis,
        "spine1": lower,
        "spine2": middle,
        "spine3": trunk.world_from_chest,
        "neck": blend(trunk.world_from_chest, trunk.world_from_head, 0.5),
        "head": trunk.world_from_head,
    }


def _enter_leg(
    rotations: Rotations,
    side: str,
    walker: _Walker,
    track: FootTrack,
    pelvis_m: Float64[np.ndarray, "N 3"],
    trunk: Trunk,
) -> Bool[np.ndarray, " N"]:
    """Adds a leg's rotations; returns where its ankle is exactly on its track."""
    leg = leg_of(walker.skeleton, side)
    bones = solve_leg(leg, track, pelvis_m, trunk.world_from_pelvis, trunk.heading_rad)
    rotations[f"{side}_hip"] = bones.world_from_upper
    rotations[f"{side}_knee"] = bones.world_from_lower
    rotations[f"{side}_ankle"] = about_z(track.yaw_rad) @ about_y(track.pitch_rad)
    rotations[f"{side}_foot"] = about_z(track.yaw_rad) @ about_y(track.toe_pitch_rad)
    return np.asarray(np.linalg.norm(bones.end_m - track.ankle_m, axis=1) < 1e-6)


def _action_of(timeline: ActionTimeline, side: str) -> TimedAction | None:
    """The action that has an arm."""
    return next((timed for timed in timeline.actions if getattr(timed.action, side) is not None), None)


def _enter_arm(
    rotations: Rotations,
    side: str,
    walker: _Walker,
    pelvis_m: Float64[np.ndarray, "N 3"],
    stride: _Stride,
    timeline: ActionTimeline,
    timed: TimedAction | None,
    clock: Clock,
) -> None:
    """Adds an arm's rotations."""
    limbs = _limbs(rotations, side, walker, pelvis_m, stride, timeline, clock)
    arm = make_arm(side, walker.skeleton, walker.style, walker.described.arm_swing, limbs, timed, timeline.shrug_rad)
    rotations[f"{side}_collar"] = rotations["spine3"] @ arm.collar
    rotations[f"{side}_shoulder"] = rotations[f"{side}_collar"] @ arm.shoulder
    rotations[f"{side}_elbow"] = rotations[f"{side}_shoulder"] @ arm.elbow
    rotations[f"{side}_wrist"] = rotations[f"{side}_elbow"] @ arm.wrist


def _limbs(
    rotations: Rotations,
    side: str,
    walker: _Walker,
    pelvis_m: Float64[np.ndarray, "N 3"],
    stride: _Stride,
    timeline: ActionTimeline,
    clock: Clock,
) -> Limbs:
    skeleton, time_s = walker.skeleton, clock.time_s
    here = SIDES.index(side)
    lead_m = _lead_m(walker, stride.tracks[1 - here], stride.tracks[here], clock)
    shoulder_m = _shoulder_m(rotations, side, skeleton, pelvis_m)
    hip_m = pelvis_m + rotate(rotations["pelvis"], bone(skeleton, "pelvis", f"{side}_hip"))
    thigh_m = hip_m + _ALONG_THIGH * rotate(rotations[f"{side}_hip"], bone(skeleton, f"{side}_hip", f"{side}_knee"))
    thigh_m[:, 2] += _WRIST_OVER_THIGH_M
    target_m = aim_m(walker.route, walker.room, clock.fps, time_s)
    known = np.isfinite(target_m).all(axis=1)
    eye_m, heading_rad = _eye_m(walker, clock), walker.path.heading_rad(time_s)
    ahead_m = eye_m + 3.0 * np.stack([np.cos(heading_rad), np.sin(heading_rad), np.zeros_like(heading_rad)], axis=1)
    target_m = np.where(known[:, None], target_m, ahead_m)
    chest = rotations["spine3"]
    aim = wrist_from(side, skeleton, target_m, shoulder_m, chest)
    return Limbs(
        gaussian_filter1d(lead_m, 0.06 / clock.step_s),
        walker.path.run_weight(time_s),
        seated_weight(walker.sittings, time_s),
        timeline.lean_rad - walker.described.lean_rad + sitting_lean_rad(walker.sittings, time_s),
        wrist_from(side, skeleton, thigh_m, shoulder_m, chest),
        0.95 * aim / np.maximum(np.linalg.norm(aim, axis=1, keepdims=True), 1e-6),
        aim_weight(side, target_m, eye_m, heading_rad),
    )


def _shoulder_m(
    rotations: Rotations, side: str, skeleton: Skeleton, pelvis_m: Float64[np.ndarray, "N 3"]
) -> Float64[np.ndarray, "N 3"]:
    place_m = pelvis_m
    for start, end in (("pelvis", "spine1"), ("spine1", "spine2"), ("spine2", "spine3")):
        place_m = place_m + rotate(rotations[start], bone(skeleton, start, end))
    return np.asarray(place_m + rotate(rotations["spine3"], bone(skeleton, "spine3", f"{side}_shoulder")))


def _contacts(stride: _Stride, reached: list[Bool[np.ndarray, " N"]]) -> Bool[np.ndarray, "N 4"]:
    return np.stack(
        [
            contact & reach
            for track, reach in zip(stride.tracks, reached, strict=True)
            for contact in (track.heel_contact, track.toe_contact)
        ],
        axis=1,
    )
