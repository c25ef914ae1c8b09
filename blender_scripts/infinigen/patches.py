# SPDX-License-Identifier: GPL-3.0-or-later
"""What is changed inside Infinigen 2 before it makes a room: its small objects, and two costs."""

from collections import OrderedDict

import bpy
import numpy as np
import trimesh
from infinigen2.objects import boulder, random_primitives
from infinigen2.scenes.placement import collision
from infinigen2.scenes.room import decoration_objects, room
from infinigen2.scenes.room.room_shape import RoomShapeResult

from blender_scripts.infinigen.small_objects import small_object_maker

# Placement asks the same furniture again and again before it goes on to other furniture.
KEPT_SCENES = 3


class Shapes:
    """The outlines of the rooms that are made, which Infinigen's result leaves out."""

    def __init__(self) -> None:
        self.floor_polygon_m: list[tuple[float, float]] = []

    def keep(self, shape: RoomShapeResult) -> None:
        """Reads the line along which the walls meet the floor, in Infinigen's coordinates, counter-clockwise."""
        edges = [edge for wall in [shape.walls, *shape.flat_walls] for edge in _floor_edges(wall.item())]
        self.floor_polygon_m = _chained(edges)


def patch(kind: str) -> Shapes:
    """Changes Infinigen for one room of a kind; the outline of its floor can be read when the room is made."""
    # Infinigen's rocks need an add-on that can only be had online, and its other small objects are abstract solids
    # or bowls and cups of ten thousand faces, each of which gets a search tree of its own wherever it is placed.
    make = small_object_maker(kind)
    boulder.rock_rand = random_primitives.primitive_with_effect_rand = make
    decoration_objects.decoration_smallobj_rand = make
    collision.raycast = _Raycast()
    shapes = Shapes()
    make_shape = room.room_shape_rand

    def make_and_keep(*arguments: object, **options: object) -> RoomShapeResult:
        shape = make_shape(*arguments, **options)
        shapes.keep(shape)
        return shape

    room.room_shape_rand = make_and_keep
    return shapes


class _Raycast:
    """Infinigen's ``collision.raycast``, with the last search structures kept instead of built for every question."""

    def __init__(self) -> None:
        self._scenes: OrderedDict[tuple, tuple[trimesh.Trimesh, list[trimesh.Trimesh]]] = OrderedDict()

    def __call__(
        self, colliders: collision.CollisionSet, ray_origins: np.ndarray, ray_directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Locations, ray numbers and triangle numbers of the first hits."""
        scene = self._scene(colliders)
        if scene is None:
            return np.empty((0, 3)), np.empty(0, np.int64), np.empty(0, np.int64)
        return scene.ray.intersects_location(
            ray_origins=np.asarray(ray_origins), ray_directions=np.asarray(ray_directions), multiple_hits=False
        )

    def _scene(self, colliders: collision.CollisionSet) -> trimesh.Trimesh | None:
        parts = placed_colliders(colliders)
        if not parts:
            return None
        key = tuple((id(mesh), placed.tobytes()) for mesh, placed in parts)
        if key not in self._scenes:
            # The parts are kept too, so that no other mesh can take one's id.
            self._scenes[key] = (joined_colliders(parts), [mesh for mesh, _ in parts])
            if len(self._scenes) > KEPT_SCENES:
                self._scenes.popitem(last=False)
        self._scenes.move_to_end(key)
        return self._scenes[key][0]


Placed = tuple[trimesh.Trimesh, np.ndarray]


def placed_colliders(colliders: collision.CollisionSet) -> list[Placed]:
    """The collision meshes of a set and where they stand (world from mesh, f64[4, 4])."""
    bpy.context.view_layer.update()
    items = [obj.item() for obj in colliders.objs]
    meshes = [colliders.mesh_colliders.get(id(item.data)) for item in items]
    placed = [np.asarray(item.matrix_world, np.float64) for item in items]
    return [(mesh, matrix) for mesh, matrix in zip(meshes, placed, strict=True) if mesh is not None]


def joined_colliders(parts: list[Placed]) -> trimesh.Trimesh:
    """One mesh in world coordinates."""
    return trimesh.util.concatenate([mesh.copy().apply_transform(matrix) for mesh, matrix in parts])


def _floor_edges(wall: bpy.types.Object) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    corners = [wall.matrix_world @ vertex.co for vertex in wall.data.vertices]
    # Walls reach a centimetre below the floor.
    points = [(round(corner.x, 3), round(corner.y, 3)) if corner.z < 0.1 else None for corner in corners]
    edges = [(points[first], points[second]) for first, second in (edge.vertices for edge in wall.data.edges)]
    return [(a, b) for a, b in edges if a is not None and b is not None and a != b]


def _chained(edges: list[tuple[tuple[float, float], tuple[float, float]]]) -> list[tuple[float, float]]:
    """The corners of the closed line that the edges make."""
    neighbours: dict[tuple[float, float], list[tuple[float, float]]] = {}
    for a, b in edges:
        for here, there in ((a, b), (b, a)):
            if there not in neighbours.setdefault(here, []):
                neighbours[here].append(there)
    if any(len(others) != 2 for others in neighbours.values()):
        raise ValueError("the walls do not close around the floor")
    line = [min(neighbours)]
    before = neighbours[line[0]][0]
    while len(line) == 1 or line[-1] != line[0]:
        first, second = neighbours[line[-1]]
        line, before = [*line, second if first == before else first], line[-1]
    corners = np.array(line[:-1])
    after = np.roll(corners, -1, axis=0)
    if (corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]).sum() < 0.0:
        corners = corners[::-1]
    return [(float(x), float(y)) for x, y in corners]
