"""Adam over all cameras of all candidates at once, as B-splines of position and of where they look."""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Bool, Float, Float64, Int64
from scipy.interpolate import BSpline
from torch import Tensor

from perpetua.cameras import losses
from perpetua.cameras.bodies import ActorBounds
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.field import SignedDistanceField
from perpetua.optimisation.adam import deterministic_torch, minimise

DEGREE = 3
CONTROL_S = 0.6
# Of sequences of this length and longer. The shorter a sequence, the faster a control point's error makes a camera.
LEARNING_RATE_M = 0.12
LEARNING_RATE_S = 5.0
LEAST_LEARNING_RATE_M = 0.02
MARGIN = 0.15
COVERED_POINTS = 2
LINE_SAMPLES = 16
LINE_WANTED_M = 0.12
# Projected height, in images, above which an actor crowds the view.
MOST_FOREGROUND = 1.2
CROWD_WANTED_M = 0.3
CROWD_POINTS = 3
# What the field and the sub-steps of the audit may add up to; actors that fill the image are kept further off.
SCENE_SPARE_M = 0.08
ACTOR_SPARE_M = 0.25
# The optimiser keeps well within the limits that the audit enforces.
SOFT_FRACTION = 0.6
LEAST_APART_RAD = np.radians(50.0)


@dataclass(frozen=True)
class Problem:
    """What the optimiser is given: S candidates, C cameras, T times evenly spaced over the sequence."""

    step_s: float
    start_m: Float64[np.ndarray, "S C T 3"]
    focus_m: Float64[np.ndarray, "S C T 3"]
    sway_m: Float64[np.ndarray, "S C T 3"]
    focus_weight: Float64[np.ndarray, "S C T A"]
    point_weight: Float64[np.ndarray, "S C L"]
    tan_half_fov: Float64[np.ndarray, "S C 2"]
    size_range: Float64[np.ndarray, "S C 2"]
    height_band_m: Float64[np.ndarray, "S C 2"]
    speed_mps: Float64[np.ndarray, "S C"]
    bounds: ActorBounds
    field: SignedDistanceField


@dataclass(frozen=True)
class Solution:
    """Control points of each camera's position and of its look target's offset from the focus, and the losses."""

    position_control_m: Float64[np.ndarray, "S C K 3"]
    offset_control_m: Float64[np.ndarray, "S C K 3"]
    loss: Float64[np.ndarray, " S"]
    terms: dict[str, Float64[np.ndarray, " S"]]


def optimise_paths(problem: Problem, config: CamerasConfig) -> Solution:
    """Minimises all losses over all candidates; candidates do not influence each other.

    The path of a view whose wished speed is 0 is a single point.
    """
    times = problem.start_m.shape[2]
    duration_s = problem.step_s * (times - 1)
    basis = spline_basis(np.linspace(0.0, 1.0, times), duration_s)
    position = torch.tensor(_controls_along(problem.start_m, basis.shape[1]), dtype=torch.float32, requires_grad=True)
    offset = torch.zeros_like(position, requires_grad=True)
    terms = _Terms(problem, config, basis)
    if config.steps > 0:
        minimise(
            [position, offset],
            lambda: {name: value.sum() for name, value in terms(position, offset).items()},
            config.steps,
            max(LEAST_LEARNING_RATE_M, LEARNING_RATE_M * min(1.0, duration_s / LEARNING_RATE_S)),
        )
    with torch.no_grad(), deterministic_torch():
        final = {name: value.double().numpy() for name, value in terms(position, offset).items()}
        path = terms.tied(position)
    return Solution(
        path.double().numpy(),
        offset.detach().double().numpy(),
        np.sum(list(final.values()), axis=0),
        final,
    )


def spline_basis(fraction: Float64[np.ndarray, " T"], duration_s: float) -> Float64[np.ndarray, "T K"]:
    """Weights of a clamped cubic B-spline's control points at shares (0 to 1) of a duration."""
    controls = max(DEGREE + 1, int(np.ceil(duration_s / CONTROL_S)) + DEGREE)
    return np.asarray(BSpline.design_matrix(fraction, _knots(controls), DEGREE).toarray())


def _knots(controls: int) -> Float64[np.ndarray, " M"]:
    return np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, controls - DEGREE + 1), np.ones(DEGREE)])


def _controls_along(path_m: Float64[np.ndarray, "S C T 3"], controls: int) -> Float64[np.ndarray, "S C K 3"]:
    """Control points on a path at the spline's Greville sites: the spline then keeps to the path's shape."""
    knots = _knots(controls)
    site = np.mean([knots[1 + i : 1 + i + controls] for i in range(DEGREE)], axis=0) * (path_m.shape[2] - 1)
    low = np.minimum(site.astype(int), path_m.shape[2] - 2)
    fraction = (site - low)[:, None]
    return (1.0 - fraction) * path_m[:, :, low] + fraction * path_m[:, :, low + 1]


class _Terms:
    """The weighted losses as a function of the control points."""

    def __init__(self, problem: Problem, config: CamerasConfig, basis: Float64[np.ndarray, "T K"]) -> None:
        self.config = config
        self.step_s = problem.step_s
        self.voxel_m = problem.field.voxel_m
        self.basis = _tensor(basis)
        self.grid = _tensor(problem.field.distance_m)
        self.origin_m = _tensor(problem.field.origin_m)
        self.focus_m = _tensor(problem.focus_m)
        self.sway_m = _tensor(problem.sway_m)
        self.focus_weight = _tensor(problem.focus_weight)
        self.point_weight = self.focus_weight[..., None] * _tensor(problem.point_weight)[:, :, None, None]
        self.tan_half_fov = _tensor(problem.tan_half_fov)
        self.size_range = _tensor(problem.size_range)
        self.height_band_m = _tensor(problem.height_band_m)
        self.speed_mps = _tensor(problem.speed_mps)
        bounds = problem.bounds
        self.axis_m, self.point_m = _tensor(bounds.axis_m), _tensor(bounds.point_m)
        self.bottom_m, self.top_m, self.radius_m = map(_tensor, (bounds.bottom_m, bounds.top_m, bounds.radius_m))
        watched = _watched_actor(problem.focus_weight)
        self.other = torch.from_numpy(_others(watched, bounds.axis_m.shape[0]))
        time = np.arange(problem.focus_m.shape[2])
        self.watched_m = _tensor(bounds.chest_m[watched, time])
        # Between head and chest.
        self.sighted_m = self.point_m[:, :, :COVERED_POINTS].mean(2).transpose(0, 1)
        self.line_fraction = torch.linspace(0.03, 0.93, LINE_SAMPLES)[:, None]
        self.still = (self.speed_mps == 0.0)[..., None, None]

    def __call__(
        self, position_control: Float[Tensor, "S C K 3"], offset_control: Float[Tensor, "S C K 3"]
    ) -> dict[str, Float[Tensor, " S"]]:
        weights = self.config.weights
        offset_m = torch.einsum("tk,scki->scti", self.basis, offset_control)
        position_m = torch.einsum("tk,scki->scti", self.basis, self.tied(position_control)) + self.sway_m
        camera_from_world = _level_axes(self.focus_m + offset_m - position_m)
        terms = (
            self._clearances(position_m)
            | self._views(position_m, camera_from_world)
            | self._motion(position_m, camera_from_world[..., 2, :])
            | {"offset": losses.unsteadiness(offset_m, 0.5)}
        )
        return {name: getattr(weights, name) * value for name, value in terms.items()}

    def tied(self, position_control: Float[Tensor, "S C K 3"]) -> Float[Tensor, "S C K 3"]:
        """The control points; those of a view that stands still are all their mean."""
        return torch.where(self.still, position_control.mean(2, keepdim=True), position_control)

    def _clearances(self, position_m: Float[Tensor, "S C T 3"]) -> dict[str, Float[Tensor, " S"]]:
        to_scene = losses.field_distance(self.grid, self.origin_m, self.voxel_m, position_m)
        to_actors = losses.capsule_distance(position_m, self.axis_m, self.bottom_m, self.top_m, self.radius_m)
        return {
            "scene_clearance": losses.clearance(to_scene, self.config.scene_clearance_m + SCENE_SPARE_M),
            "actor_clearance": losses.clearance(to_actors, self.config.actor_clearance_m + ACTOR_SPARE_M),
        }

    def _views(
        self, position_m: Float[Tensor, "S C T 3"], camera_from_world: Float[Tensor, "S C T 3 3"]
    ) -> dict[str, Float[Tensor, " S"]]:
        sight_m = self.point_m.transpose(0, 1) - position_m[..., None, None, :]
        in_camera_m = torch.einsum("sctij,sctalj->sctali", camera_from_world, sight_m)
        distance_m = sight_m[..., 1, :].square().sum(-1).add(1e-8).sqrt()
        blocked = self._blocked(position_m)
        height_m = self.top_m - self.bottom_m
        least, most = self.size_range.unbind(-1)
        return {
            "framing": losses.framing(in_camera_m, self.tan_half_fov, self.point_weight, MARGIN),
            "size": losses.size(distance_m, height_m, self.tan_half_fov, least, most, self.focus_weight),
            "coverage": losses.coverage(
                in_camera_m[..., :COVERED_POINTS, :], self.tan_half_fov, blocked, self.config.views_per_actor, MARGIN
            ),
            "occlusion": losses.occlusion(blocked, self.focus_weight),
            "crowding": losses.crowding(
                position_m, self.watched_m, self.point_m[:, :, :CROWD_POINTS], self.other, CROWD_WANTED_M
            ),
            "foreground": losses.foreground(in_camera_m, height_m, self.tan_half_fov, MOST_FOREGROUND),
            "diversity": losses.diversity(position_m, self.axis_m, float(np.cos(LEAST_APART_RAD))),
        }

    def _blocked(self, position_m: Float[Tensor, "S C T 3"]) -> Float[Tensor, "S C T A"]:
        sight_m = self.sighted_m - position_m[..., None, :]
        line_m = position_m[..., None, None, :] + self.line_fraction * sight_m[..., None, :]
        return losses.blocked(losses.field_distance(self.grid, self.origin_m, self.voxel_m, line_m), LINE_WANTED_M)

    def _motion(
        self, position_m: Float[Tensor, "S C T 3"], forward: Float[Tensor, "S C T 3"]
    ) -> dict[str, Float[Tensor, " S"]]:
        config = self.config
        velocity = position_m.diff(dim=2) / self.step_s
        acceleration = velocity.diff(dim=2) / self.step_s
        turning = forward.diff(dim=2) / self.step_s
        turning_change = turning.diff(dim=2) / self.step_s
        steepest = torch.tensor(np.sin(np.radians(config.max_pitch_deg * SOFT_FRACTION)), dtype=forward.dtype)
        low_m, high_m = self.height_band_m.unbind(-1)
        return {
            "smoothness": losses.unsteadiness(acceleration, 1.0),
            "rotation": losses.unsteadiness(turning, 0.5) + losses.unsteadiness(turning_change, 1.0),
            "limits": losses.over_limit(_length(velocity), SOFT_FRACTION * config.max_speed_mps)
            + losses.over_limit(_length(acceleration), SOFT_FRACTION * config.max_acceleration_mps2)
            + losses.over_limit(_length(turning), SOFT_FRACTION * float(np.radians(config.max_turn_deg_per_s))),
            "travel": losses.travel(position_m, self.step_s, self.speed_mps),
            "revisiting": losses.revisiting(position_m, self.step_s),
            "height": losses.outside_band(position_m[..., 2], low_m, high_m, 0.3),
            "pitch": losses.outside_band(
                forward[..., 2], -steepest.expand(forward.shape[:2]), steepest.expand(forward.shape[:2]), 0.2
            ),
        }


def _level_axes(sight_m: Float[Tensor, "S C T 3"]) -> Float[Tensor, "S C T 3 3"]:
    """``camera_from_world`` rotations (rows right, down, forward) of level cameras that look along ``sight_m``."""
    forward = sight_m / _length(sight_m)[..., None]
    right = torch.stack([forward[..., 1], -forward[..., 0], torch.zeros_like(forward[..., 0])], dim=-1)
    right = right / _length(right)[..., None]
    return torch.stack([right, torch.linalg.cross(forward, right), forward], dim=-2)


def _length(vectors: Float[Tensor, "*batch 3"]) -> Float[Tensor, "*batch"]:
    return vectors.square().sum(-1).add(1e-10).sqrt()


def _tensor(values: np.ndarray) -> Tensor:
    return torch.tensor(values, dtype=torch.float32)


def _watched_actor(focus_weight: Float64[np.ndarray, "S C T A"]) -> Int64[np.ndarray, "S C T"]:
    """The actor whose line of sight counts at each time: members of the focus take turns."""
    strongest = focus_weight >= 0.999 * focus_weight.max(axis=-1, keepdims=True)
    turn = np.arange(focus_weight.shape[2])[:, None] % np.maximum(strongest.sum(axis=-1, keepdims=True), 1)
    rank = np.cumsum(strongest, axis=-1) - 1
    return np.asarray((strongest & (rank == turn)).argmax(axis=-1))


def _others(watched: Int64[np.ndarray, "S C T"], actors: int) -> Bool[np.ndarray, "S C T A"]:
    return np.asarray(watched[..., None] != np.arange(actors))
