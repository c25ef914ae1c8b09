"""What is wrong with a route, in words a user understands."""

import math

import numpy as np
import trimesh

from perpetua.routes.checks import Violation
from perpetua.scene.room import Room

UNITS = {"speed": "m/s", "acceleration": "m/s^2", "turn rate": "rad/s"}


def explain(violation: Violation, room: Room, steps_per_frame: int) -> str:
    """The rule that a route breaks, where, by how much, and what is allowed."""
    frame, who = round(violation.step / steps_per_frame), f"route of actor {violation.actor}"
    value, limit = violation.value, violation.limit
    if violation.rule == "clearance":
        name = _nearest_object(room, violation.place_m)
        return f"{who} comes within {value:.2f} m of '{name}' at frame {frame}; at least {limit:.2f} m is required"
    if violation.rule == "separation":
        return (
            f"{who} comes within {value:.2f} m of actor {violation.other} at frame {frame}; "
            f"at least {limit:.2f} m is required"
        )
    if violation.rule == "sidestep":
        return f"{who} walks {value:.2f} rad off its heading at frame {frame}; at most {limit:.2f} rad is allowed"
    unit = UNITS[violation.rule]
    article = "an" if violation.rule == "acceleration" else "a"
    allowed = f"at most {limit:.2f} {unit} is allowed"
    return f"{who} has {article} {violation.rule} of {value:.2f} {unit} at frame {frame}; {allowed}"


def _nearest_object(room: Room, place_m: tuple[float, float]) -> str:
    """The name of what is nearest to a body's middle at this place."""
    waist_m = np.array([[*place_m, 1.0]])
    nearest_m, name = math.inf, "the edge of the floor"
    for obj in room.objects:
        if obj.walkable or not len(obj.mesh.faces):
            continue
        triangles = obj.mesh.vertices_m[obj.mesh.faces]
        closest = trimesh.triangles.closest_point(triangles, np.repeat(waist_m, len(triangles), axis=0))
        # Across the floor, since a body stands from floor to head.
        distance_m = float(np.linalg.norm(closest[:, :2] - waist_m[:, :2], axis=1).min())
        if distance_m < nearest_m and closest[:, 2].min() < 2.0:
            nearest_m, name = distance_m, obj.name
    return name
