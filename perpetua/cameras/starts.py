"""Where the optimisation starts: for each view a chain of free places that see its focus, by dynamic programming."""

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.cameras.bodies import ActorBounds, bounds_at, capsule_distance_m
from perpetua.cameras.config import CamerasConfig
from perpetua.cameras.sdf import distance_at_m, voxel_centres_m
from perpetua.cameras.types import SignedDistanceField
from perpetua.cameras.wishes import ViewWish
from perpetua.geometry.raycast import Caster

PLACES = 140
KNOT_S = 1.4
ROOMY_M = 0.2
EDGE_SAMPLES = 7
BLOCKED_COST = 50.0


def draw_start(
    rng: np.random.Generator,
    wish: ViewWish,
    field: SignedDistanceField,
    caster: Caster,
    bounds: ActorBounds,
    duration_s: float,
    config: CamerasConfig,
) -> Float64[np.ndarray, "M 3"]:
    """Way points of one view, evenly spaced in time over the sequence.

    The chain has the least sum of costs of its places (focus hidden or of the wrong size, too near an actor, wrong
    direction or height) and of its steps (other length than the speed asks, through furniture, against the style).
    ``bounds`` holds the sequence's frames.
    """
    knots = max(2, round(duration_s / KNOT_S) + 1)
    frames = bounds.axis_m.shape[1]
    then = bounds_at(bounds, np.linspace(0.0, frames - 1.0, knots))
    weight = wish.focus.weights(np.linspace(0.0, duration_s, knots), bounds.axis_m.shape[0])
    focus_m = np.einsum("ta,ati->ti", weight, then.chest_m)
    places_m = _draw_places_m(rng, wish, field, then, config)
    nearby = bounds_at(bounds, np.linspace(0.0, frames - 1.0, 4 * (knots - 1) + 1))
    place_cost = (
        6.0 * _hidden_share(places_m, caster, then, weight)
        + _size_cost(places_m, wish, then, weight)
        + _crowd_cost(places_m, nearby, knots, config.actor_clearance_m)
        + (1.5 * _azimuth_cost(places_m, wish, then))[:, None]
    )
    step_cost = _step_cost(places_m, focus_m, wish, field, duration_s / (knots - 1), config)
    return places_m[_cheapest_chain(place_cost, step_cost)]


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


def _hidden_share(
    places_m: Float64[np.ndarray, "N 3"], caster: Caster, bounds: ActorBounds, weight: Float64[np.ndarray, "M A"]
) -> Float64[np.ndarray, "N M"]:
    """Share of the focus's head and chest points that a place cannot see past the scene, at each knot."""
    targets_m = bounds.point_m[:, :, :2]
    shape = (len(places_m), *targets_m.shape[:-1])
    origins_m = np.broadcast_to(places_m[:, None, None, None], (*shape, 3)).reshape(-1, 3)
    clear = caster.clear(origins_m, np.broadcast_to(targets_m, (*shape, 3)).reshape(-1, 3)).reshape(shape)
    return np.einsum("namk,ma->nm", ~clear, weight) / targets_m.shape[2]


def _size_cost(
    places_m: Float64[np.ndarray, "N 3"], wish: ViewWish, bounds: ActorBounds, weight: Float64[np.ndarray, "M A"]
) -> Float64[np.ndarray, "N M"]:
    distance_m = np.linalg.norm(places_m[:, None, None] - bounds.chest_m, axis=-1)
    size = bounds.height_m / (2.0 * np.maximum(distance_m, 0.3) * np.tan(0.5 * wish.fov_rad))
    wrong = np.maximum(np.log(wish.framing.least_size / size), np.log(size / wish.framing.most_size))
    return np.einsum("nam,ma->nm", np.maximum(wrong, 0.0) ** 2, weight) * 4.0


def _crowd_cost(
    places_m: Float64[np.ndarray, "N 3"], nearby: ActorBounds, knots: int, clearance_m: float
) -> Float64[np.ndarray, "N M"]:
    """Too near an actor at a knot or on the way to its neighbours."""
    distance_m = capsule_distance_m(places_m[:, None], nearby).min(axis=0)
    lacking = np.maximum(clearance_m + 0.25 - distance_m, 0.0) / (clearance_m + 0.25)
    around = [lacking[:, max(0, 4 * k - 2) : 4 * k + 3].max(axis=1) for k in range(knots)]
    return 15.0 * np.stack(around, axis=1) ** 2


def _step_cost(
    places_m: Float64[np.ndarray, "N 3"],
    focus_m: Float64[np.ndarray, "M 3"],
    wish: ViewWish,
    field: SignedDistanceField,
    knot_s: float,
    config: CamerasConfig,
) -> Float64[np.ndarray, "K N N"]:
    """Cost of going from place i to place j in each interval between knots."""
    step_m = places_m[None] - places_m[:, None]
    length_m = np.linalg.norm(step_m, axis=-1)
    wished_m = wish.speed_mps * knot_s
    cost = ((length_m - wished_m) / wished_m) ** 2 + BLOCKED_COST * _blocked(places_m, step_m, field, config)
    unit = step_m / np.maximum(length_m, 1e-6)[..., None]
    return np.stack([cost + _style_cost(places_m, unit, focus_m[k : k + 2], wish) for k in range(len(focus_m) - 1)])


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
    share = np.linspace(0.0, 1.0, EDGE_SAMPLES)[:, None, None, None]
    # A place in a nook may lie nearer to the scene than the limit; the optimiser moves it out.
    return np.asarray((distance_at_m(field, places_m[:, None] + share * step_m) < config.scene_clearance_m).any(axis=0))


def _cheapest_chain(place_cost: Float64[np.ndarray, "N M"], step_cost: Float64[np.ndarray, "K N N"]) -> list[int]:
    """Viterbi's algorithm: the places, one per knot, with the least sum of place and step costs."""
    total = place_cost[:, 0]
    before: list[np.ndarray] = []
    for knot in range(1, place_cost.shape[1]):
        arriving = total[:, None] + step_cost[knot - 1]
        before.append(arriving.argmin(axis=0))
        total = arriving.min(axis=0) + place_cost[:, knot]
    chain = [int(np.argmin(total))]
    for previous in reversed(before):
        chain.append(int(previous[chain[-1]]))
    return chain[::-1]
