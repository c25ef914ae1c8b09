"""How soles keep to the floor: their slide while they stand, their depth in it and their height above it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.actors.checks.checked_actor import CheckedActor
from perpetua.actors.checks.penetration import Worst
from perpetua.geometry.raycast import Caster
from perpetua.motion.kinematics import CONTACT_JOINTS, contact_positions, joint_index
from perpetua.scene.actor import CONTACTS, Route

# A vertex of the sole lies this near to a contact point, in the plane of the sole and above it, in the rest pose.
_SOLE_RADIUS_M, _SOLE_THICKNESS_M = 0.06, 0.025
# Floor is looked for from this far above the route.
_FLOOR_SEARCH_M = 0.3


def _sole_zone(checked: CheckedActor, contact: int) -> tuple[Int64[np.ndarray, " S"], int]:
    """Vertices of the sole around a contact point, and the one nearest to it, found where the point stands."""
    standing = np.flatnonzero(checked.motion.contacts[:, contact])
    frame = int(standing[0]) if len(standing) > 0 else 0
    world_from_joint = checked.motion.world_from_joint[frame, joint_index(CONTACT_JOINTS[contact])]
    place_m = contact_positions(checked.motion, checked.skeleton)[frame, contact]
    # From the contact point, in the axes of the rest pose.
    offset_m = (checked.actor.vertices_m[frame].astype(np.float64) - place_m) @ world_from_joint
    nearest = int(np.linalg.norm(offset_m, axis=1).argmin())
    near = (np.linalg.norm(offset_m[:, :2], axis=1) < _SOLE_RADIUS_M) & (np.abs(offset_m[:, 2]) < _SOLE_THICKNESS_M)
    near[nearest] = True
    return np.flatnonzero(near), nearest


def slide_mps(checked: CheckedActor, fps: float) -> Float64[np.ndarray, " K"]:
    """Speed over the floor of each contact's vertex, over all pairs of frames in which it stands."""
    contacts = checked.motion.contacts
    speeds = [np.zeros(0)]
    for contact in range(len(CONTACTS)):
        _, vertex = _sole_zone(checked, contact)
        path_m = checked.actor.vertices_m[:, vertex, :2].astype(np.float64)
        stands = contacts[1:, contact] & contacts[:-1, contact]
        speeds.append(np.linalg.norm(np.diff(path_m, axis=0), axis=1)[stands] * fps)
    return np.concatenate(speeds)


@dataclass(frozen=True)
class Soles:
    """The deepest sole in the floor at any frame, the highest above it while it is to stand, and 99th percentiles."""

    deepest: Worst
    penetration_99th_m: float
    highest: Worst
    floating_99th_m: float


def sole_figures(checked: CheckedActor, floor: Caster) -> Soles:
    """How deep the soles of an actor are in the floor, and how high above it while they stand."""
    deepest, highest = Worst(0.0, 0, "the floor"), Worst(0.0, 0, "the floor")
    standing_m = [np.zeros(0)]
    for contact, name in enumerate(CONTACTS):
        zone, _ = _sole_zone(checked, contact)
        sole_m = checked.actor.vertices_m[:, zone].astype(np.float64)
        point_m = sole_m[np.arange(len(sole_m)), sole_m[:, :, 2].argmin(axis=1)]
        height_m = point_m[:, 2] - _floor_z_m(floor, point_m, checked.route)
        place = f"the floor with the {name.replace('_', ' ')}"
        low = int(height_m.argmin())
        if -height_m[low] > deepest.value_m:
            deepest = Worst(float(-height_m[low]), low, place)
        stands = checked.motion.contacts[:, contact]
        above_m = np.where(stands, height_m, -np.inf)
        high = int(above_m.argmax())
        if above_m[high] > highest.value_m:
            highest = Worst(float(above_m[high]), high, place)
        standing_m.append(height_m[stands])
    all_m = np.concatenate(standing_m)
    if len(all_m) == 0:
        return Soles(deepest, 0.0, highest, 0.0)
    return Soles(
        deepest,
        max(-float(np.percentile(all_m, 1.0)), 0.0),
        highest,
        max(float(np.percentile(all_m, 99.0)), 0.0),
    )


def _floor_z_m(floor: Caster, point_m: Float64[np.ndarray, "T 3"], route: Route) -> Float64[np.ndarray, " T"]:
    """Height of the floor under points; the route's where no walkable surface is below."""
    origin_m = point_m.copy()
    origin_m[:, 2] = route.position_m[:, 2] + _FLOOR_SEARCH_M
    hits = floor.first_hit(origin_m, np.tile([0.0, 0.0, -1.0], (len(point_m), 1)))
    found_m = origin_m[:, 2] - np.where(hits.hit, hits.distance_m, 0.0)
    near = hits.hit & (hits.distance_m < 2.0 * _FLOOR_SEARCH_M)
    return np.where(near, found_m, route.position_m[:, 2])
