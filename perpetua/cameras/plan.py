"""The camera stage: candidates drawn from the seed, optimised together; the best one that passes the audit wins."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64
from scipy import ndimage

from perpetua.cameras.audit import CameraAudit, audit_paths
from perpetua.cameras.bodies import ActorBounds, actor_bounds, bounds_at
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.field import SignedDistanceField, signed_distance_field
from perpetua.cameras.focus import FocusSchedule
from perpetua.cameras.moving_mesh import MovingMesh
from perpetua.cameras.optimise import Problem, Solution, optimise_paths, spline_basis
from perpetua.cameras.spec import ViewWish, draw_wishes, shown_points
from perpetua.cameras.starts import StartScene, ViewStart, draw_starts
from perpetua.errors import CameraError
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.raycast import Caster
from perpetua.geometry.transforms import look_at
from perpetua.scene.actor import ActorMesh
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

# The losses look at the paths this often; splines with a control point every 0.6 s do not change faster.
RATE_HZ = 8.0
LEAST_TIMES = 9
FOCUS_SMOOTHING_S = 0.25


@dataclass(frozen=True)
class CameraPlan:
    """The winning paths and how they came about; ``focus`` says whom each view is to show at each frame."""

    paths: tuple[CameraPath, ...]
    focus: Bool[np.ndarray, "C T A"]
    wishes: tuple[ViewWish, ...]
    audit: CameraAudit
    terms: dict[str, float]
    redraw: int
    candidate: int

    def to_json(self) -> dict[str, Any]:
        """The figures of the audit and of the losses, as plain values."""
        return {
            "scene_distance_m": self.audit.scene_distance_m.tolist(),
            "actor_distance_m": self.audit.actor_distance_m.tolist(),
            "focus_share": self.audit.focus_fraction.tolist(),
            "travel_m": self.audit.travel_m.tolist(),
            "covered_share": self.audit.covered_fraction.tolist(),
            "apart_deg": self.audit.apart_deg.tolist(),
            "loss_terms": self.terms,
            "redraw": self.redraw,
            "candidate": self.candidate,
        }


@dataclass(frozen=True)
class CameraScene:
    """What all candidates share; ``meshes`` are the actors' once more, for the audit."""

    room: Room
    actors: tuple[ActorMesh, ...]
    meshes: tuple[MovingMesh, ...]
    bounds: ActorBounds
    caster: Caster
    field: SignedDistanceField
    fps: float
    width_px: int
    height_px: int

    @property
    def times_s(self) -> Float64[np.ndarray, " T"]:
        return np.arange(self.bounds.axis_m.shape[1]) / self.fps


def plan_cameras(
    room: Room,
    actors: tuple[ActorMesh, ...],
    config: CamerasConfig,
    frames: int,
    fps: float,
    width_px: int,
    height_px: int,
    seed: StageSeed,
) -> CameraPlan:
    """Moving cameras that show the actors from clearly different directions and touch nothing.

    Args:
        room: all its meshes are obstacles, whether opaque or not.
        actors: their meshes, with ``frames`` frames each.
        config: wishes, limits, weights and effort.
        frames: length of the sequence, at least 2.
        fps: frames per second.
        width_px: image width.
        height_px: image height.
        seed: what everything is drawn from.

    Raises:
        CameraError: no candidate of any redraw passes the audit; the message names the rules broken by the best.
    """
    _require_inputs(actors, frames)
    scene = camera_scene(room, actors, config, fps, width_px, height_px)
    nearest: CameraAudit | None = None
    for redraw in range(config.max_redraws + 1):
        drafts = [draw_draft(scene, config, seed, redraw, candidate) for candidate in range(config.candidates)]
        solution = optimise_paths(pose_problem(scene, drafts, config), config)
        for candidate in np.argsort(solution.loss, kind="stable"):
            draft = drafts[candidate]
            paths = make_paths(scene, draft, solution, int(candidate))
            focus = draft.focus(scene)
            audit = audit_paths(paths, focus, room, actors, scene.meshes, scene.caster, fps, config)
            if audit.passed:
                terms = {name: float(values[candidate]) for name, values in solution.terms.items()}
                return CameraPlan(paths, focus, draft.wishes, audit, terms, redraw, int(candidate))
            if nearest is None or len(audit.violations) < len(nearest.violations):
                nearest = audit
    assert nearest is not None
    raise CameraError(
        f"no camera paths in '{room.name}' keep every rule after {config.max_redraws} redraws "
        f"(cameras.max_redraws); the best set breaks: " + "; ".join(each.message for each in nearest.violations)
    )


def camera_scene(
    room: Room, actors: tuple[ActorMesh, ...], config: CamerasConfig, fps: float, width_px: int, height_px: int
) -> CameraScene:
    """Measures the room and its actors, once for all candidates."""
    caster = room.surfaces.caster
    field = signed_distance_field(room, caster, config.voxel_m)
    meshes = tuple(MovingMesh(actor) for actor in actors)
    return CameraScene(room, actors, meshes, actor_bounds(actors), caster, field, fps, width_px, height_px)


def _require_inputs(actors: tuple[ActorMesh, ...], frames: int) -> None:
    if not actors:
        raise CameraError("cameras need at least one actor to look at; there are 0: raise actors.count")
    if frames < 2:
        raise CameraError(f"moving cameras need at least 2 frames, not {frames}: raise sequence.frames")
    for actor in actors:
        if len(actor.vertices_m) != frames:
            raise CameraError(
                f"actor {actor.actor} has {len(actor.vertices_m)} frames where the sequence has {frames}: "
                "make the actors again for this length"
            )


@dataclass(frozen=True)
class Draft:
    """One candidate before it is optimised."""

    wishes: tuple[ViewWish, ...]
    starts: tuple[ViewStart, ...]

    def focus(self, scene: CameraScene) -> Bool[np.ndarray, "C T A"]:
        """Whom each view is to show at each frame."""
        return np.stack([start.focus.members(scene.times_s, len(scene.actors)) for start in self.starts])


def draw_draft(scene: CameraScene, config: CamerasConfig, seed: StageSeed, redraw: int, candidate: int) -> Draft:
    """Draws what one candidate's views are to be like, and where they start."""
    wishes = draw_wishes(seed, redraw, candidate, scene.room.height_m, config)
    aspect = scene.height_px / scene.width_px
    start_scene = StartScene(scene.field, scene.caster, scene.bounds, float(scene.times_s[-1]), aspect, config)
    return Draft(wishes, draw_starts(seed, redraw, candidate, wishes, start_scene))


def pose_problem(scene: CameraScene, drafts: list[Draft], config: CamerasConfig) -> Problem:
    """The optimisation of all drafts together."""
    frames = len(scene.times_s)
    duration_s = float(scene.times_s[-1])
    times = max(LEAST_TIMES, int(np.ceil(duration_s * RATE_HZ)) + 1)
    sampled_s = np.linspace(0.0, duration_s, times)
    shape = (len(drafts), config.count)

    def each(values: list[np.ndarray]) -> np.ndarray:
        return np.stack(values).reshape(*shape, *values[0].shape)

    flat = [wish for draft in drafts for wish in draft.wishes]
    starts = [start for draft in drafts for start in draft.starts]
    aspect = scene.height_px / scene.width_px
    return Problem(
        step_s=duration_s / (times - 1),
        start_m=each([_interpolate(start.knots_m, times) for start in starts]),
        focus_m=each([_interpolate(_focus_m(scene, start.focus), times) for start in starts]),
        sway_m=each([wish.sway.at(sampled_s)[:, :3] for wish in flat]),
        focus_weight=each([start.focus.weights(sampled_s, len(scene.actors)) for start in starts]),
        point_weight=each([shown_points(wish) for wish in flat]),
        tan_half_fov=each([np.tan(0.5 * wish.fov_rad) * np.array([1.0, aspect]) for wish in flat]),
        size_range=each([np.array([wish.framing.least_size, wish.framing.most_size]) for wish in flat]),
        height_band_m=each([np.array(wish.height_m) for wish in flat]),
        speed_mps=each([np.array(wish.speed_mps) for wish in flat]),
        bounds=bounds_at(scene.bounds, np.linspace(0.0, frames - 1.0, times)),
        field=scene.field,
    )


def _focus_m(scene: CameraScene, focus: FocusSchedule) -> Float64[np.ndarray, "T 3"]:
    """The point a view looks at: its focus's chests, smoothed so that steps do not shake the camera."""
    weight = focus.weights(scene.times_s, len(scene.actors))
    point_m = np.einsum("ta,ati->ti", weight, scene.bounds.chest_m)
    return np.asarray(ndimage.gaussian_filter1d(point_m, FOCUS_SMOOTHING_S * scene.fps, axis=0, mode="nearest"))


def _interpolate(points_m: Float64[np.ndarray, "M 3"], count: int) -> Float64[np.ndarray, "T 3"]:
    """``count`` points evenly spaced in time along points that are evenly spaced in time."""
    given, wanted = np.linspace(0.0, 1.0, len(points_m)), np.linspace(0.0, 1.0, count)
    return np.stack([np.interp(wanted, given, points_m[:, i]) for i in range(3)], axis=1)


def make_paths(scene: CameraScene, draft: Draft, solution: Solution, candidate: int) -> tuple[CameraPath, ...]:
    """The paths of one candidate at every frame, with their sway."""
    times_s = scene.times_s
    basis = spline_basis(np.linspace(0.0, 1.0, len(times_s)), float(times_s[-1]))
    paths = []
    for view, (wish, start) in enumerate(zip(draft.wishes, draft.starts, strict=True)):
        sway = wish.sway.at(times_s)
        position_m = np.einsum("tk,ki->ti", basis, solution.position_control_m[candidate, view]) + sway[:, :3]
        target_m = _focus_m(scene, start.focus) + np.einsum(
            "tk,ki->ti", basis, solution.offset_control_m[candidate, view]
        )
        intrinsics = Intrinsics.centred(scene.width_px, scene.height_px, wish.fov_rad)
        paths.append(CameraPath(wish.camera, _swayed(position_m, target_m, sway[:, 3:]), intrinsics))
    return tuple(paths)


def _swayed(
    position_m: Float64[np.ndarray, "T 3"],
    target_m: Float64[np.ndarray, "T 3"],
    yaw_pitch_roll_rad: Float64[np.ndarray, "T 3"],
) -> Float64[np.ndarray, "T 4 4"]:
    """Level cameras that look at targets, turned by small angles about their own down, right and forward axes."""
    world_from_level = look_at(position_m, target_m)
    yaw, pitch, roll = yaw_pitch_roll_rad.T
    level_from_camera = np.zeros((len(position_m), 4, 4))
    level_from_camera[:, 3, 3] = 1.0
    level_from_camera[:, :3, :3] = _rotation(1, yaw) @ _rotation(0, pitch) @ _rotation(2, roll)
    return np.asarray(world_from_level @ level_from_camera)


def _rotation(axis: int, angle_rad: Float64[np.ndarray, " T"]) -> Float64[np.ndarray, "T 3 3"]:
    matrix = np.zeros((len(angle_rad), 3, 3))
    following, last = (axis + 1) % 3, (axis + 2) % 3
    matrix[:, axis, axis] = 1.0
    matrix[:, following, following] = matrix[:, last, last] = np.cos(angle_rad)
    matrix[:, last, following] = np.sin(angle_rad)
    matrix[:, following, last] = -np.sin(angle_rad)
    return matrix
