"""What the room stage hands on."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from jaxtyping import Float64, UInt8

from perpetua.geometry.mesh import TriMesh
from perpetua.scene.surfaces import Surfaces

PATTERNS = (
    "plain", "wood", "planks", "fabric", "velvet", "tile", "bricks", "plaster", "marble", "terrazzo", "brushed",
    "wicker", "checks", "stripes", "wallpaper",
)  # fmt: skip


@dataclass(frozen=True)
class Material:
    """A surface that is cheap to render: one colour, a node pattern, or an image through the mesh's UVs.

    ``base_color`` and ``second_color`` are linear RGB in [0, 1]. ``pattern`` is one of ``PATTERNS``; ``scale_m`` is
    the size of its repeat in metres. ``image`` is an sRGB texture (row 0 on top); it replaces colour and pattern. On
    a room's object it repeats every ``scale_m``, or covers the object once where that is 0. ``emission_w_m2`` > 0
    makes the surface a lamp.
    """

    name: str
    base_color: tuple[float, float, float]
    second_color: tuple[float, float, float] = (0.5, 0.5, 0.5)
    roughness: float = 0.6
    metallic: float = 0.0
    pattern: str = "plain"
    scale_m: float = 0.1
    image: UInt8[np.ndarray, "H W 3"] | None = None
    emission_w_m2: float = 0.0


@dataclass(frozen=True)
class AreaLight:
    """A rectangular lamp that shines along ``direction``; ``power_w`` is Blender's radiant watts."""

    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    size_m: tuple[float, float]
    power_w: float
    color: tuple[float, float, float]


@dataclass(frozen=True)
class Sky:
    """What lies outside the windows: a gradient without depth; colours are linear RGB, radiance that of white."""

    zenith_color: tuple[float, float, float]
    horizon_color: tuple[float, float, float]
    ground_color: tuple[float, float, float]
    radiance_w_m2_sr: float


@dataclass(frozen=True)
class SceneObject:
    """One rendered object of a room, exactly as rendered.

    ``mesh`` is in world coordinates; in a .blend the object with this ``object_index`` as pass index has the same
    triangles. ``material`` is None where the room's .blend carries it. ``walkable``: a person may stand on its
    upward faces. ``opaque``: depth and object index are well defined on it.
    """

    object_index: int
    name: str
    category: str
    mesh: TriMesh
    material: Material | None
    walkable: bool
    opaque: bool


@dataclass(frozen=True)
class Room:
    """A furnished room. World origin on the floor (z = 0) under the middle of ``floor_polygon_m``'s bounding box.

    ``sky`` is None where the room's .blend carries it, or where a plain day will do.
    """

    name: str
    kind: str
    floor_polygon_m: Float64[np.ndarray, "K 2"]
    height_m: float
    objects: tuple[SceneObject, ...]
    lights: tuple[AreaLight, ...]
    blend_path: Path | None
    sky: Sky | None = None

    @cached_property
    def surfaces(self) -> Surfaces:
        """All objects. Kept, as are the next two: a room is joined, and a caster built for it, once per process."""
        return self._joined(lambda obj: True)

    @cached_property
    def obstacles(self) -> Surfaces:
        """What nobody may touch: all objects but those that are walked on."""
        return self._joined(lambda obj: not obj.walkable)

    @cached_property
    def opaque(self) -> Surfaces:
        """Objects that hide what is behind them."""
        return self._joined(lambda obj: obj.opaque)

    def _joined(self, wanted: Callable[[SceneObject], bool]) -> Surfaces:
        return Surfaces.of({obj.object_index: obj.mesh for obj in self.objects if wanted(obj)})

    @property
    def next_object_index(self) -> int:
        """The first object index that the room leaves free."""
        return max(obj.object_index for obj in self.objects) + 1
