"""Halls."""

from pathlib import Path

import numpy as np
import trimesh

from perpetua.geometry.mesh import TriMesh
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.source import RoomWish
from perpetua.scene.room import AreaLight, Material, Room, SceneObject
from perpetua.seeding import StageSeed


class Hall:
    """An empty hall with columns where the seed puts them."""

    def draws(self, config: RoomsConfig) -> int | None:
        """As many different halls as anybody wants."""
        return None

    def make(self, wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A hall of the size that is wished for."""
        x_m, y_m, height_m = wish.size_m
        rng = seed.stream("columns", attempt)
        meshes = _shell(x_m, y_m, height_m)
        for number, side in enumerate((-0.35, 0.35)):
            centre_m = (side * x_m, rng.uniform(-0.3, 0.3) * y_m, height_m / 2)
            meshes[f"column_{number}"] = _block((0.3, 0.3, height_m), centre_m)
        objects = tuple(
            SceneObject(
                object_index=index,
                name=name,
                category=name.split("_")[0],
                mesh=mesh,
                material=Material("plaster", tuple(rng.uniform(0.3, 0.8, 3)), pattern="plaster"),
                walkable=name == "floor",
                opaque=True,
            )
            for index, (name, mesh) in enumerate(meshes.items(), start=1)
        )
        lamp = AreaLight((0.0, 0.0, height_m - 0.05), (0.0, 0.0, -1.0), (1.0, 1.0), 150.0, (1.0, 1.0, 1.0))
        corners_m = np.array([[-x_m, -y_m], [x_m, -y_m], [x_m, y_m], [-x_m, y_m]]) / 2
        return Room("hall", "hall", corners_m, height_m, objects, (lamp,), None)


def _shell(x_m: float, y_m: float, height_m: float) -> dict[str, TriMesh]:
    """Floor, ceiling and four walls, by name."""
    middle_m = height_m / 2
    return {
        "floor": _block((x_m, y_m, 0.1), (0, 0, -0.05)),
        "ceiling": _block((x_m, y_m, 0.1), (0, 0, height_m + 0.05)),
        "wall_east": _block((0.1, y_m, height_m), (x_m / 2, 0, middle_m)),
        "wall_west": _block((0.1, y_m, height_m), (-x_m / 2, 0, middle_m)),
        "wall_north": _block((x_m, 0.1, height_m), (0, y_m / 2, middle_m)),
        "wall_south": _block((x_m, 0.1, height_m), (0, -y_m / 2, middle_m)),
    }


def _block(size_m: tuple[float, float, float], centre_m: tuple[float, float, float]) -> TriMesh:
    made = trimesh.creation.box(size_m, trimesh.transformations.translation_matrix(centre_m))
    return TriMesh(np.array(made.vertices, np.float64), np.array(made.faces, np.int32))
