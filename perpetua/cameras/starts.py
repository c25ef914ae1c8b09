"""Where the optimisation starts: who watches whom when, and from where.

Views are settled one after the other. For each of several focus schedules, dynamic programming finds the cheapest
chain of free places; a chain is cheap where its view sees its focus, and sees actors whom too few of the other
views see. Going over the views twice lets the first ones answer to the last.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.cameras.bodies import ActorBounds, bounds_at, capsule_distance_m
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.field import SignedDistanceField, distance_at_m, voxel_centres_m
from perpetua.cameras.focus import FocusSchedule, draw_focus
from perpetua.cameras.spec import ViewWish
from perpetua.geometry.raycast import Caster
from perpetua.geometry.transforms import look_at
from perpetua.seeding import StageSeed

PLACES = 140
KNOT_S = 1.4
# Moments at which sight is tested, for each interval between knots.
MOMENTS = 4
SCHEDULES = 6
SWEEPS = 2
ROOMY_M = 0.2
EDGE_SAMPLES = 7
BLOCKED_COST = 50.0
HIDDEN_COST = 6.0
SHADOWED_COST = 3.0
SHADOW_M = 0.3
COVERAGE_GAIN = 3.0
AZIMUTH_COST = 1.5
# Steps of a view that stands still cost this much for each metre.
STILL_COST_PER_M = 1e3
SIGHT_POINTS = 2
IMAGE_FRACTION = 0.9
SEEN_FRACTION = 0.5


@dataclass(frozen=True)
class StartScene:
    """What all views of all candidates start from; ``bounds`` holds the sequence's frames."""

    field: SignedDistanceField
    caster: Caster
    bounds: ActorBounds
    duration_s: float
    aspect: float
    config: CamerasConfig

    @property
    def knots(self) -> int:
        """How many way points a start has."""
        return max(2, round(self.duration_s / KNOT_S) + 1)

    @cached_property
    def moment_s(self) -> Float64[np.ndarray, " F"]:
        """The moments at which sight is tested."""
        return np.linspace(0.0, self.duration_s, MOMENTS * (self.knots - 1) + 1)

    @cached_property
    def moments(self) -> ActorBounds:
        """The actors at those moments."""
        return bounds_at(self.bounds, np.linspace(0.0, self.bounds.axis_m.shape[1] - 1.0, len(self.moment_s)))


@dataclass(frozen=True)
class ViewStart:
    """Whom a view watches, and its way points, evenly spaced in time over the sequence."""

    focus: FocusSchedule
    knots_m: Float64[np.ndarray, "M 3"]


@dataclass(frozen=True)
class _Chain:
    start: ViewStart
    sees: Bool[np.ndarray, "F A"]
    cost: float


def draw_starts(
    seed: StageSeed, redraw: int, candidate: int, wishes: tuple[ViewWish, ...], scene: StartScene
) -> tuple[ViewStart, ...]:
    """Starts of all views of one candidate."""
    actors = scene.bounds.axis_m.shape[0]
    leaders = seed.stream("leaders", redraw, candidate).permutation(actors)
    views = []
    for wish in wishes:
        rng = seed.stream("start", redraw, candidate, wish.camera)
        schedules = [
            draw_focus(rng, scene.bounds, scene.duration_s, int(leaders[(wish.camera + k) % actors]), wish.grouping)
            for k in range(SCHEDULES)
        ]
        views.append(_View(rng, wish, schedules, scene))
    nobody = np.zeros((len(scene.moment_s), actors), bool)
    chains: dict[int, _Chain] = {}
    # Views with wide lenses have the most to show to choose from, and go first.
    order = sorted(range(len(wishes)), key=lambda view: -wishes[view].fov_rad)
    for view in order * SWEEPS:
        seen_by = sum((chains[other].sees.astype(int) for other in chains if other != view), nobody.astype(int))
        chains[view] = views[view].best_chain(seen_by)
    return tuple(chains[view].start for view in range(len(wishes)))


class _View:
    """The places one view may take, and what each would see."""

    def __init__(
        self, rng: np.random.Generator, wish: ViewWish, schedules: list[FocusSchedule], scene: StartScene
    ) -> None:
        self.wish, self.schedules, self.scene = wish, schedules, scene
        self.places_m = _draw_places_m(rng, wish, scene.field, scene.moments, scene.config)
        self.clear = _clear(self.places_m, scene.caster, scene.moments)
        crowd = _crowd_cost(self.places_m, scene.moments, scene.config.actor_clearance_m)
        azimuth = _azimuth_cost(self.places_m, wish, scene.moments)
        self.place_cost = _at_knots(crowd, np.max) + AZIMUTH_COST * azimuth[:, None]
        self.size_cost = _size_cost(self.places_m, wish, scene.moments)
        self.size_cost += SHADOWED_COST * _shadowed(self.places_m, scene.moments)
        step_m = self.places_m[None] - self.places_m[:, None]
        length_m = np.linalg.norm(step_m, axis=-1)
        self.unit = step_m / np.maximum(length_m, 1e-6)[..., None]
        blocked = _blocked(self.places_m, step_m, scene.field, scene.config)
        self.step_cost = BLOCKED_COST * blocked + _length_cost(length_m, wish, scene.duration_s / (scene.knots - 1))

    def best_chain(self, seen_by: Int64[np.ndarray, "F A"]) -> _Chain:
        """The cheapest chain of any schedule, where ``seen_by`` counts the other views that see each actor."""
        lacking = seen_by < self.scene.config.views_per_actor
        # An actor whom the others seldom see is wanted the most.
        need = lacking * (0.5 + lacking.mean(axis=0))
        return min((self._chain(schedule, need) for schedule in self.schedules), key=lambda chain: chain.cost)

    def _chain(self, schedule: FocusSchedule, need: Float64[np.ndarray, "F A"]) -> _Chain:
        moments = self.scene.moments
        weight = schedule.weights(self.scene.moment_s, moments.axis_m.shape[0])
        focus_m = np.einsum("fa,afi->fi", weight, moments.chest_m)
        seen = (_in_image(self.places_m, focus_m, self.wish, moments, self.scene.aspect) & self.clear).mean(axis=-1)
        sight_cost = np.einsum(
            "nfa,fa->nf", HIDDEN_COST * (1.0 - seen) + self.size_cost, weight
        ) - COVERAGE_GAIN * np.einsum("nfa,fa->nf", seen, need)
        place_cost = self.place_cost + _at_knots(sight_cost, np.mean)
        at_knots_m = focus_m[::MOMENTS]
        style_cost = [
            _style_cost(self.places_m, self.unit, at_knots_m[k : k + 2], self.wish) for k in range(len(at_knots_m) - 1)
        ]
        chain, cost = _cheapest_chain(place_cost, self.step_cost + np.stack(style_cost))
        knot = np.round(np.arange(len(focus_m)) / MOMENTS).astype(int)
        sees = seen[np.array(chain)[knot], np.arange(len(focus_m))] >= SEEN_FRACTION
        return _Chain(ViewStart(schedule, self.places_m[chain]), sees, cost)


def _at_knots(values: Float64[np.ndarray, "N F"], reduce: Callable[..., np.ndarray]) -> Float64[np.ndarray, "N M"]:
    """Values at moments, reduced over those around each knot."""
    knots = range(0, values.shape[1], MOMENTS)
    half = MOMENTS // 2
    return np.stack([reduce(values[:, max(0, k - half) : k + half + 1], axis=1) for k in knots], axis=1)


def _draw_places_m(
    rng: np.random.Generator, wish: ViewWish, field: SignedDistanceField, bounds: ActorBounds, config: CamerasConfig
) -> Float64[np.ndarray, "N 3"]:
    for spare_m in (ROOMY_M, 0.1, 0.0):
        roomy = field.distance_m > config.scene_clearance_m + spare_m
        if np.count_nonzero(roomy) >= PLACES:
            break
    free_m = voxel_centres_m(field, roomy if roomy.any() else field.distance_m > 0.0)
    low_m, high_m = wish.height_m
    wrong_height_m = np.maximum(np.maximum(low_m - free_m[:, 2], free_m[:, 2] - high_m), 0.0)
    wrong_side = np.maximum(_azimuth_cost(free_m, wish, bounds) - 0.4, 0.0)
    order = np.argsort(wrong_height_m + wrong_side + rng.uniform(0.0, 0.4, len(free_m)), kind="stable")
    return np.asarray(free_m[order[:PLACES]])


def _azimuth_cost(
    places_m: Float64[np.ndarray, "N 3"], wish: ViewWish, bounds: ActorBounds
) -> Float64[np.ndarray, " N"]:
    """1 - cosine between the place's direction from the actors' middle and the wished one."""
    offset = places_m[:, :2] - bounds.axis_m.mean(axis=(0, 1))
    length_m = np.maximum(np.linalg.norm(offset, axis=1), 1e-6)
    wished = np.array([np.cos(wish.azimuth_rad), np.sin(wish.azimuth_rad)])
    return np.asarray(1.0 - offset @ wished / length_m)


def _clear(places_m: Float64[np.ndarray, "N 3"], caster: Caster, bounds: ActorBounds) -> Bool[np.ndarray, "N F A L"]:
    """Whether nothing of the scene lies between a place and an actor's head and chest."""
    targets_m = np.swapaxes(bounds.point_m[:, :, :SIGHT_POINTS], 0, 1)
    shape = (len(places_m), *targets_m.shape)
    origins_m = np.broadcast_to(places_m[:, None, None, None], shape).reshape(-1, 3)
    return caster.clear(origins_m, np.broadcast_to(targets_m, shape).reshape(-1, 3)).reshape(shape[:-1])


def _in_image(
    places_m: Float64[np.ndarray, "N 3"],
    focus_m: Float64[np.ndarray, "F 3"],
    wish: ViewWish,
    bounds: ActorBounds,
    aspect: float,
) -> Bool[np.ndarray, "N F A L"]:
    """Whether the same points lie in the image of a level camera that looks at the focus."""
    world_from_camera = look_at(*np.broadcast_arrays(places_m[:, None], focus_m[None]))
    offset_m = np.swapaxes(bounds.point_m[:, :, :SIGHT_POINTS], 0, 1) - places_m[:, None, None, None]
    in_camera_m = np.einsum("nfji,nfalj->nfali", world_from_camera[..., :3, :3], offset_m)
    reach = IMAGE_FRACTION * np.tan(0.5 * wish.fov_rad) * np.array([1.0, aspect]) * in_camera_m[..., 2:]
    return np.asarray((np.abs(in_camera_m[..., :2]) < reach).all(axis=-1))


def _shadowed(places_m: Float64[np.ndarray, "N 3"], bounds: ActorBounds) -> Bool[np.ndarray, "N F A"]:
    """Whether another actor stands in the line from a place to an actor's chest."""
    chest_m = np.swapaxes(bounds.chest_m, 0, 1)
    sight_m = chest_m - places_m[:, None, None]
    offset_m = np.swapaxes(bounds.axis_m, 0, 1)[None, :, None] - places_m[:, None, None, None, :2]
    square_m2 = np.maximum((sight_m[..., :2] ** 2).sum(axis=-1), 1e-6)
    along = np.clip(np.einsum("nfabi,nfai->nfab", offset_m, sight_m[..., :2]) / square_m2[..., None], 0.0, 1.0)
    beside_m = np.linalg.norm(offset_m - along[..., None] * sight_m[..., None, :2], axis=-1)
    height_m = places_m[:, None, None, None, 2] + along * sight_m[..., None, 2]
    between = (beside_m < SHADOW_M) & (along > 0.0) & (along < 1.0) & (height_m < bounds.top_m.T[:, None])
    between &= ~np.eye(len(bounds.top_m), dtype=bool)
    return np.asarray(between.any(axis=-1))


def _size_cost(
    places_m: Float64[np.ndarray, "N 3"], wish: ViewWish, bounds: ActorBounds
) -> Float64[np.ndarray, "N F A"]:
    distance_m = np.linalg.norm(places_m[:, None, None] - bounds.chest_m, axis=-1)
    size = bounds.height_m / (2.0 * np.maximum(distance_m, 0.3) * np.tan(0.5 * wish.fov_rad))
    wrong = np.maximum(np.log(wish.framing.least_size / size), np.log(size / wish.framing.most_size))
    return np.asarray(4.0 * np.swapaxes(np.maximum(wrong, 0.0) ** 2, 1, 2))


def _crowd_cost(
    places_m: Float64[np.ndarray, "N 3"], bounds: ActorBounds, clearance_m: float
) -> Float64[np.ndarray, "N F"]:
    """Too near an actor."""
    distance_m = capsule_distance_m(places_m[:, None], bounds).min(axis=0)
    return 15.0 * (np.maximum(clearance_m + 0.25 - distance_m, 0.0) / (clearance_m + 0.25)) ** 2


def _length_cost(length_m: Float64[np.ndarray, "N N"], wish: ViewWish, knot_s: float) -> Float64[np.ndarray, "N N"]:
    if wish.speed_mps == 0.0:
        return STILL_COST_PER_M * length_m
    wished_m = wish.speed_mps * knot_s
    return ((length_m - wished_m) / wished_m) ** 2


def _style_cost(
    places_m: Float64[np.ndarray, "N 3"],
    unit: Float64[np.ndarray, "N N 3"],
    focus_m: Float64[np.ndarray, "2 3"],
    wish: ViewWish,
) -> Float64[np.ndarray, "N N"]:
    sight = focus_m[0] - places_m
    sight = sight / np.maximum(np.linalg.norm(sight, axis=1, keepdims=True), 1e-6)
    towards = np.einsum("ijk,ik->ij", unit, sight) ** 2
    follow = focus_m[1] - focus_m[0]
    # A focus that stands still is followed by no direction in particular.
    follow = follow / max(float(np.linalg.norm(follow)), 0.3)
    style = wish.style
    return np.asarray(style.radial * (1.0 - towards) + style.tangential * towards - style.along * (unit @ follow))


def _blocked(
    places_m: Float64[np.ndarray, "N 3"],
    step_m: Float64[np.ndarray, "N N 3"],
    field: SignedDistanceField,
    config: CamerasConfig,
) -> Bool[np.ndarray, "N N"]:
    fraction = np.linspace(0.0, 1.0, EDGE_SAMPLES)[:, None, None, None]
    # A place in a nook may lie nearer to the scene than the limit; the optimiser moves it out.
    return np.asarray(
        (distance_at_m(field, places_m[:, None] + fraction * step_m) < config.scene_clearance_m).any(axis=0)
    )


def _cheapest_chain(
    place_cost: Float64[np.ndarray, "N M"], step_cost: Float64[np.ndarray, "K N N"]
) -> tuple[list[int], float]:
    """Viterbi's algorithm: the places, one per knot, with the least sum of place and step costs; and that sum."""
    total = place_cost[:, 0]
    before: list[np.ndarray] = []
    for knot in range(1, place_cost.shape[1]):
        arriving = total[:, None] + step_cost[knot - 1]
        before.append(arriving.argmin(axis=0))
        total = arriving.min(axis=0) + place_cost[:, knot]
    chain = [int(np.argmin(total))]
    for previous in reversed(before):
        chain.append(int(previous[chain[-1]]))
    return chain[::-1], float(total.min())
