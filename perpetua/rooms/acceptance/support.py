"""What holds each object of a room up, from the meshes as rendered: nothing may hang in the air or be sunk.

An object is *held* when a chain of contacts joins it to the building. Two contacts count, both within ``TOUCH_M``:

- it rests: straight below some point of its underside lies the surface of a held object;
- it is fixed: in some direction from its surface, or inside it, lies the surface of a held object. This counts only
  for what can hang, lean or be built in (a painting, a tap, a wall cabinet). What stands by its nature
  (``STANDING``: seats, tables, beds, objects on shelves) has to rest, so a chair that hovers beside a wall floats.

Parts of one piece of furniture, which have its category and overlap its box, hold each other.

A standing object is *sunk* when most of its feet lie deeper than ``TOUCH_M`` below the upward surface of another.
Rays decide all of it, each against every triangle of the room, so what is found is what a picture shows.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64, Int64

from perpetua.geometry.mesh import TriMesh, join
from perpetua.geometry.raycast import Caster
from perpetua.scene.room import SceneObject

TOUCH_M = 0.03
# The building itself, and what is always built into it.
BUILDING = frozenset(
    {
        "floor",
        "wall",
        "ceiling",
        "skirting_board",
        "window",
        "window_frame",
        "door",
        "door_frame",
        "column",
        "beam",
    }
)
# Furniture that stands by its own weight. It may come in several parts of one category (a lamp and its shade).
FURNITURE = frozenset(
    {
        "armchair",
        "bed",
        "bedside_table",
        "bench",
        "chair",
        "cocktail_table",
        "coffee_table",
        "desk",
        "desk_chair",
        "dining_table",
        "floor_lamp",
        "side_table",
        "sofa",
        "stool",
        "table",
        "table_lamp",
    }
)
# Objects that lie or stand on something.
SMALL_OBJECTS = frozenset(
    {
        "books",
        "bottle",
        "bowl",
        "box",
        "candle",
        "clutter",
        "cup",
        "jar",
        "monitor",
        "picture_frame",
        "plant",
        "rug",
        "towels",
        "vase",
    }
)
STANDING = FURNITURE | SMALL_OBJECTS
# An underside is looked at on about this many places each way, and no closer than this.
PLACES_PER_SIDE = 24
MIN_SPACING_M = 0.01
# Feet are what lies within this of the lowest point.
FEET_M = 0.02
# A ray passes this many surfaces, its own object's among them.
MAX_SURFACES = 8
MIN_UPWARD_NORMAL = 0.5
_PAST_SURFACE_M = 1e-5
RAISED_M, GOLDEN_SECTION = 4e-4, 0.618034
# Rays start this much beside a mesh's corners: along its own edges they would meet nothing else.
_ASIDE_M = np.array([0.0007, 0.0004, 0.0003])
_DOWN = np.array([[0.0, 0.0, -1.0]])
# To the sides, up and down, and between them.
_AROUND = np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (-1, 0, 1) if (x, y, z) != (0, 0, 0)])
_AROUND = _AROUND / np.linalg.norm(_AROUND, axis=1, keepdims=True)


@dataclass(frozen=True)
class Fault:
    """An object that nothing holds (``floats``), or that is sunk: how far it would fall, or how deep it is."""

    name: str
    category: str
    floats: bool
    distance_m: float

    def __str__(self) -> str:
        if self.floats:
            return f"'{self.name}' hangs in the air, {self.distance_m:.2f} m above what is below it"
        return f"'{self.name}' is sunk {self.distance_m:.2f} m into what it stands on"


def find_faults(objects: tuple[SceneObject, ...]) -> tuple[Fault, ...]:
    """Every object that nothing holds, or that is sunk by more than ``TOUCH_M``, in the order of ``objects``."""
    solid = tuple(obj for obj in objects if len(obj.mesh.faces))
    if not solid:
        return ()
    scene = _Scene(tuple(_raised(obj, number) for number, obj in enumerate(solid)))
    held = _held(scene)
    return tuple(fault for k in range(len(solid)) if (fault := _fault(scene, k, bool(held[k]))) is not None)


def _raised(obj: SceneObject, number: int) -> SceneObject:
    """An object a hair higher, each by another amount: a foot that ends in the plane of the floor would hide the floor
    from rays, which see one of two surfaces at one place."""
    if obj.category in BUILDING:
        return obj
    lift_m = RAISED_M * (0.1 + 0.9 * (number * GOLDEN_SECTION % 1.0))
    return replace(obj, mesh=TriMesh(obj.mesh.vertices_m + np.array([0.0, 0.0, lift_m]), obj.mesh.faces))


def _fault(scene: "_Scene", k: int, held: bool) -> Fault | None:
    obj = scene.objects[k]
    # What lies too deep to rest on anything is sunk, though nothing below holds it.
    depth_m = scene.depth_m(k) if obj.category in STANDING else 0.0
    if depth_m > TOUCH_M:
        return Fault(obj.name, obj.category, False, depth_m)
    return None if held else Fault(obj.name, obj.category, True, scene.drop_m(k))


def _held(scene: "_Scene") -> Bool[np.ndarray, " N"]:
    """Which objects a chain of contacts joins to the building."""
    held = np.array([obj.category in BUILDING for obj in scene.objects], bool)
    touches = scene.rests_on() | scene.parts_of_one()
    loose = ~_joined(held, touches)
    # Looking in every direction is dear, so only what does not rest is looked at.
    hung = [int(k) for k in np.flatnonzero(loose) if scene.objects[k].category not in STANDING]
    return _joined(held, touches | scene.fixed_to(hung))


def _joined(held: Bool[np.ndarray, " N"], touches: Bool[np.ndarray, "N N"]) -> Bool[np.ndarray, " N"]:
    while True:
        more = held | touches[:, held].any(axis=1)
        if np.array_equal(more, held):
            return held
        held = more


class _Scene:
    """All triangles of a room, and whose they are."""

    def __init__(self, objects: tuple[SceneObject, ...]) -> None:
        self.objects = objects
        mesh = join([obj.mesh for obj in objects])
        self._caster = Caster(mesh)
        self._owner = np.repeat(np.arange(len(objects)), [len(obj.mesh.faces) for obj in objects])
        corners_m = mesh.vertices_m[mesh.faces]
        normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
        self._upward = normal[:, 2] > MIN_UPWARD_NORMAL * np.linalg.norm(normal, axis=1)

    def rests_on(self) -> Bool[np.ndarray, "N N"]:
        """[i, j]: object j lies within reach straight below (or a little above) the underside of object i.

        The building rests on nothing.
        """
        nothing = np.zeros((0, 3))
        undersides = [nothing if obj.category in BUILDING else _underside_m(obj.mesh) for obj in self.objects]
        return self._touches(undersides, _DOWN)

    def parts_of_one(self) -> Bool[np.ndarray, "N N"]:
        """[i, j]: objects i and j are parts of one piece of furniture."""
        low_m = np.array([obj.mesh.vertices_m.min(axis=0) for obj in self.objects]) - TOUCH_M
        high_m = np.array([obj.mesh.vertices_m.max(axis=0) for obj in self.objects])
        overlap = ((low_m[:, None] <= high_m) & (low_m <= high_m[:, None])).all(axis=2)
        return overlap & self._alike()

    def _alike(self) -> Bool[np.ndarray, "N N"]:
        category = np.array([obj.category for obj in self.objects])
        return np.asarray((category[:, None] == category) & np.isin(category, sorted(FURNITURE)))

    def fixed_to(self, objs: list[int]) -> Bool[np.ndarray, "N N"]:
        """[i, j]: object j lies within reach of the surface of object i, one of ``objs``, in some direction."""
        surfaces = [np.zeros((0, 3))] * len(self.objects)
        for k in objs:
            surfaces[k] = _thinned(_points_m(self.objects[k].mesh), 3)
        return self._touches(surfaces, _AROUND)

    def drop_m(self, k: int) -> float:
        """How far an object could fall."""
        points_m = _underside_m(self.objects[k].mesh)
        distance_m, owner, _ = self._pierce(points_m, np.repeat(_DOWN, len(points_m), axis=0))
        return float(np.where(owner != k, distance_m, np.inf).min(initial=np.inf))

    def depth_m(self, k: int) -> float:
        """How deep most feet of an object lie below the upward surface of another that crosses the object."""
        feet_m = _feet_m(self.objects[k].mesh) - _PAST_SURFACE_M * _DOWN
        distance_m, owner, face = self._pierce(feet_m, np.repeat(-_DOWN, len(feet_m), axis=0))
        # Only what lies between a foot and its own object's next surface above is inside the object.
        own = owner == k
        before_own = (np.cumsum(own, axis=1) == 0) & own.any(axis=1, keepdims=True)
        crossing = before_own & (owner >= 0) & self._upward[face] & ~self._alike()[k][owner]
        return float(np.median(np.where(crossing, distance_m, 0.0).max(axis=1, initial=0.0)))

    def _touches(
        self, points_m: list[Float64[np.ndarray, "_ 3"]], directions: Float64[np.ndarray, "D 3"]
    ) -> Bool[np.ndarray, "N N"]:
        """[i, j]: object j crosses the lines of 2 ``TOUCH_M`` through the points of object i along the directions."""
        asking = np.repeat(np.arange(len(points_m)), [len(some_m) * len(directions) for some_m in points_m])
        origins_m = np.repeat(np.concatenate(points_m), len(directions), axis=0)
        along = np.tile(directions, (sum(map(len, points_m)), 1))
        _, owner, _ = self._pierce(origins_m - TOUCH_M * along, along, 2.0 * TOUCH_M)
        ray, surface = np.nonzero((owner >= 0) & (owner != asking[:, None]))
        met = np.zeros((len(self.objects), len(self.objects)), bool)
        met[asking[ray], owner[ray, surface]] = True
        return met

    def _pierce(
        self, origins_m: Float64[np.ndarray, "R 3"], along: Float64[np.ndarray, "R 3"], reach_m: float = np.inf
    ) -> tuple[Float64[np.ndarray, "R S"], Int64[np.ndarray, "R S"], Int64[np.ndarray, "R S"]]:
        """Distance, owner (-1: none) and triangle of the first surfaces on each ray, in order."""
        shape = (len(origins_m), MAX_SURFACES)
        distance_m, owner, face = np.full(shape, np.inf), np.full(shape, -1), np.full(shape, -1)
        start_m, going = np.zeros(len(origins_m)), np.arange(len(origins_m))
        for surface in range(MAX_SURFACES):
            found = self._caster.first_hit(origins_m[going] + start_m[going, None] * along[going], along[going])
            at_m = start_m[going] + found.distance_m
            hit = found.hit & (at_m <= reach_m)
            going, at_m = going[hit], at_m[hit]
            if len(going) == 0:
                break
            distance_m[going, surface], face[going, surface] = at_m, found.face[hit]
            owner[going, surface] = self._owner[found.face[hit]]
            start_m[going] = at_m + _PAST_SURFACE_M
        return distance_m, owner, face


def _points_m(mesh: TriMesh) -> Float64[np.ndarray, "_ 3"]:
    """Corners of a mesh, and places on its long edges and large triangles."""
    corners_m = mesh.vertices_m[mesh.faces]
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    side_m = np.sqrt(np.linalg.norm(normal, axis=1))
    spacing_m = max(float(np.ptp(mesh.vertices_m, axis=0).max()) / PLACES_PER_SIDE, MIN_SPACING_M)
    points_m = [mesh.vertices_m[np.unique(mesh.faces)], _along_edges_m(mesh, spacing_m)]
    for steps in (2, 4, 8, 16, 32):
        some = corners_m[(side_m > 0.5 * steps * spacing_m) & (side_m <= steps * spacing_m)]
        points_m.append(np.einsum("kc,fcx->fkx", _lattice(steps), some).reshape(-1, 3))
    return np.concatenate(points_m)


def _along_edges_m(mesh: TriMesh, spacing_m: float) -> Float64[np.ndarray, "_ 3"]:
    """Places on edges longer than the spacing: all that long slivers have."""
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    edges = edges[np.linalg.norm(np.diff(mesh.vertices_m[edges], axis=1)[:, 0], axis=1) > spacing_m]
    ends_m = mesh.vertices_m[np.unique(edges, axis=0)]
    steps = np.ceil(np.linalg.norm(ends_m[:, 1] - ends_m[:, 0], axis=1) / spacing_m).astype(np.int64)
    edge = np.repeat(np.arange(len(ends_m)), steps)
    number = np.arange(len(edge)) - np.repeat(np.cumsum(steps) - steps, steps)
    fraction = ((number + 0.5) / steps[edge])[:, None]
    return np.asarray((1.0 - fraction) * ends_m[edge, 0] + fraction * ends_m[edge, 1])


def _lattice(steps: int) -> Float64[np.ndarray, "K 3"]:
    """Barycentric weights of even places inside a triangle."""
    first, second = np.divmod(np.arange(steps * steps), steps)
    inside = first + second < steps
    u, v = (first[inside] + 1.0 / 3.0) / steps, (second[inside] + 1.0 / 3.0) / steps
    return np.stack([1.0 - u - v, u, v], axis=1)


def _thinned(points_m: Float64[np.ndarray, "P 3"], axes: int) -> Float64[np.ndarray, "_ 3"]:
    """The lowest point of each cell of a grid over the first ``axes`` axes, a hair aside."""
    low_m, size_m = points_m.min(axis=0), np.ptp(points_m, axis=0)
    spacing_m = max(float(size_m.max()) / PLACES_PER_SIDE, MIN_SPACING_M)
    points_m = points_m[np.argsort(points_m[:, 2], kind="stable")]
    cell = np.floor((points_m - low_m)[:, :axes] / spacing_m).astype(np.int64)
    number = np.ravel_multi_index(tuple(cell.T), (PLACES_PER_SIDE + 1,) * axes)
    _, first = np.unique(number, return_index=True)
    return points_m[np.sort(first)] + _ASIDE_M


def _underside_m(mesh: TriMesh) -> Float64[np.ndarray, "_ 3"]:
    return _thinned(_points_m(mesh), 2)


def _feet_m(mesh: TriMesh) -> Float64[np.ndarray, "_ 3"]:
    """Places on what is lowest of an object, away from edges where it has faces there."""
    corners_m = mesh.vertices_m[mesh.faces]
    normal = np.cross(corners_m[:, 1] - corners_m[:, 0], corners_m[:, 2] - corners_m[:, 0])
    centre_m = corners_m.mean(axis=1)
    lowest_m = float(mesh.vertices_m[np.unique(mesh.faces)][:, 2].min())
    sole = (normal[:, 2] < -MIN_UPWARD_NORMAL * np.linalg.norm(normal, axis=1)) & (centre_m[:, 2] < lowest_m + FEET_M)
    if not sole.any():
        underside_m = _underside_m(mesh)
        return underside_m[underside_m[:, 2] < lowest_m + FEET_M]
    return _thinned(np.einsum("kc,fcx->fkx", _lattice(2), corners_m[sole]).reshape(-1, 3), 2)
