"""Full-body motion from rules: footsteps, locked feet, legs by inverse kinematics, a trunk and arms that follow.

Everything is planned as functions of time and evaluated on a fine grid that holds the frames, so any frame rate works.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d

from perpetua.actors.config import MotionConfig
from perpetua.actors.motion.actions import Performance, perform
from perpetua.actors.motion.arms import ArmRotations, hanging_arm, reaching_arm
from perpetua.actors.motion.feet import FootTrack, foot_track
from perpetua.actors.motion.footsteps import FootstepPlanner
from perpetua.actors.motion.kinematics import bone, joint_index
from perpetua.actors.motion.legs import SIDES, foot_of, leg_of, pelvis_heights_m, solve_leg
from perpetua.actors.motion.path import RoutePath
from perpetua.actors.motion.rotations import about_y, about_z, blend
from perpetua.actors.motion.source import MOTION_SOURCES
from perpetua.actors.motion.style import GaitStyle, draw_gait_style
from perpetua.actors.motion.trunk import Trunk, make_trunk, spine_between
from perpetua.actors.types import BODY_JOINTS, BodyMotion, Route, Skeleton
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

_FINE_HZ = 120.0
# Filters over time see this much of what comes before the first and after the last frame.
_FILTER_MARGIN_S = 0.8
# Share of the leg by which the pelvis stands lower than with straight legs: at rest, and more when walking.
_STANDING_DROP, _WALKING_DROP = 0.008, 0.008


@dataclass(frozen=True)
class _Walker:
    """Who moves, how, and where."""

    skeleton: Skeleton
    style: GaitStyle
    performance: Performance
    path: RoutePath


@dataclass(frozen=True)
class _Clock:
    """Evenly spaced times around the frames, and where the frames are among them."""

    time_s: Float64[np.ndarray, " N"]
    step_s: float
    at_frames: slice


@MOTION_SOURCES.register("procedural")
class ProceduralMotion:
    """Walks, strolls, turns and stands along any route, with arms posed by words."""

    def make(
        self, route: Route, skeleton: Skeleton, room: Room, fps: float, config: MotionConfig, seed: StageSeed
    ) -> BodyMotion:
        """See ``MotionSource.make``."""
        hip_m = bone(skeleton, "right_hip", "left_hip")
        style = draw_gait_style(seed.stream("style", route.actor), 0.5 * float(hip_m[1]))
        walker = _Walker(skeleton, style, perform(route.description), RoutePath(route, fps))
        clock = _clock(len(route.heading_rad), fps)
        feet = _feet(walker, seed.stream("steps", route.actor), clock)
        trunk = _trunk(walker, feet, clock)
        pelvis_m = np.column_stack([trunk.pelvis_xy_m, _pelvis_height_m(walker, trunk, feet, clock)])
        rotations = _trunk_rotations(trunk)
        reached = [
            _enter_leg(rotations, side, walker, track, pelvis_m, trunk) for side, track in zip(SIDES, feet, strict=True)
        ]
        for side, other in ((0, 1), (1, 0)):
            _enter_arm(rotations, SIDES[side], walker, trunk, feet[side], feet[other], clock)
        contacts = np.stack(
            [
                contact & reach
                for track, reach in zip(feet, reached, strict=True)
                for contact in (track.heel_contact, track.toe_contact)
            ],
            axis=1,
        )
        world_from_joint = np.stack([rotations[name] for name in BODY_JOINTS], axis=1)
        at = clock.at_frames
        return BodyMotion(
            route.actor,
            fps,
            np.ascontiguousarray(world_from_joint[at]),
            np.ascontiguousarray(pelvis_m[at]),
            np.ascontiguousarray(contacts[at]),
        )


def _clock(frames: int, fps: float) -> _Clock:
    fine = max(1, int(np.ceil(_FINE_HZ / fps)))
    margin = int(np.ceil(_FILTER_MARGIN_S * fps)) * fine
    count = (frames - 1) * fine + 1
    time_s = (np.arange(count + 2 * margin) - margin) / (fps * fine)
    return _Clock(time_s, 1.0 / (fps * fine), slice(margin, margin + count, fine))


def _feet(walker: _Walker, rng: np.random.Generator, clock: _Clock) -> tuple[FootTrack, FootTrack]:
    left, right = (foot_of(walker.skeleton, side) for side in SIDES)
    leg = leg_of(walker.skeleton, "left")
    hip_height_m = float(left.ankle_height_m - (leg.thigh_m + leg.shin_m)[2])
    ankle_ahead_m = float(bone(walker.skeleton, "pelvis", "left_ankle")[0])
    planner = FootstepPlanner(walker.path, walker.style, hip_height_m, ankle_ahead_m, rng)
    plants = planner.plan()
    clearance_m = walker.style.clearance_m
    return (
        foot_track(plants[0], left, clearance_m, clock.time_s),
        foot_track(plants[1], right, clearance_m, clock.time_s),
    )


def _trunk(walker: _Walker, feet: tuple[FootTrack, FootTrack], clock: _Clock) -> Trunk:
    lead_m = _lead_m(walker, feet[0], feet[1], clock)
    return make_trunk(
        walker.path, walker.style, walker.performance, feet[0].on_floor, feet[1].on_floor, lead_m, clock.time_s
    )


def _lead_m(walker: _Walker, foot: FootTrack, other: FootTrack, clock: _Clock) -> Float64[np.ndarray, " N"]:
    """How far a foot is ahead of the other along the heading."""
    heading_rad = walker.path.heading_rad(clock.time_s)
    apart_m = foot.ankle_m - other.ankle_m
    return np.asarray(apart_m[:, 0] * np.cos(heading_rad) + apart_m[:, 1] * np.sin(heading_rad))


def _pelvis_height_m(
    walker: _Walker, trunk: Trunk, feet: tuple[FootTrack, FootTrack], clock: _Clock
) -> Float64[np.ndarray, " N"]:
    legs = (leg_of(walker.skeleton, "left"), leg_of(walker.skeleton, "right"))
    sole_m = float(walker.skeleton.contact_m[:, 2].min())
    floor_m = gaussian_filter1d(walker.path.position_m(clock.time_s)[:, 2], 0.15 / clock.step_s)
    pace = np.clip(walker.path.speed_mps(clock.time_s) / 1.0, 0.0, 1.0)
    drop_m = (_STANDING_DROP + _WALKING_DROP * pace) * legs[0].reach_m
    nominal_m = floor_m + walker.skeleton.joint_m[joint_index("pelvis"), 2] - sole_m - drop_m
    ankles_m = (feet[0].ankle_m, feet[1].ankle_m)
    return pelvis_heights_m(nominal_m, trunk.pelvis_xy_m, trunk.world_from_pelvis, legs, ankles_m, clock.step_s)


def _trunk_rotations(trunk: Trunk) -> dict[str, Float64[np.ndarray, "N 3 3"]]:
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
    rotations: dict[str, Float64[np.ndarray, "N 3 3"]],
    side: str,
    walker: _Walker,
    track: FootTrack,
    pelvis_m: Float64[np.ndarray, "N 3"],
    trunk: Trunk,
) -> np.ndarray:
    """Adds a leg's rotations; returns where its ankle is exactly on its track."""
    leg = leg_of(walker.skeleton, side)
    bones = solve_leg(leg, track, pelvis_m, trunk.world_from_pelvis, trunk.heading_rad)
    rotations[f"{side}_hip"] = bones.world_from_upper
    rotations[f"{side}_knee"] = bones.world_from_lower
    rotations[f"{side}_ankle"] = about_z(track.yaw_rad) @ about_y(track.pitch_rad)
    rotations[f"{side}_foot"] = about_z(track.yaw_rad) @ about_y(track.toe_pitch_rad)
    return np.asarray(np.linalg.norm(bones.end_m - track.ankle_m, axis=1) < 1e-6)


def _enter_arm(
    rotations: dict[str, Float64[np.ndarray, "N 3 3"]],
    side: str,
    walker: _Walker,
    trunk: Trunk,
    foot: FootTrack,
    other: FootTrack,
    clock: _Clock,
) -> None:
    """Adds an arm's rotations."""
    style, performance = walker.style, walker.performance
    reach = performance.left if side == "left" else performance.right
    lead_m = gaussian_filter1d(_lead_m(walker, other, foot, clock), 0.06 / clock.step_s)
    if reach is None:
        forward_rad = performance.arm_swing * style.arm_swing_rad_per_m * lead_m + 0.05
        arm = hanging_arm(side, trunk.world_from_chest, forward_rad, style.arm_abduction_rad, style.elbow_rad)
    else:
        # A held hand still bobs a little with the steps.
        sway = np.stack([0.02 * lead_m, np.zeros_like(lead_m), 0.01 * lead_m**2], axis=1)
        arm = reaching_arm(side, walker.skeleton, trunk.world_from_chest, reach, sway, clock.time_s)
    _enter(rotations, side, arm)


def _enter(rotations: dict[str, Float64[np.ndarray, "N 3 3"]], side: str, arm: ArmRotations) -> None:
    rotations[f"{side}_collar"] = arm.collar
    rotations[f"{side}_shoulder"] = arm.shoulder
    rotations[f"{side}_elbow"] = arm.elbow
    rotations[f"{side}_wrist"] = arm.wrist
