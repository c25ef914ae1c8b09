"""What a procedural room consists of before anything is built."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float64

from perpetua.rooms.procedural.finish.palette import Palette
from perpetua.scene.room import AreaLight, Sky

DETAILS = 24
RUG_THICKNESS_M = 0.01
SKIRTING_HEIGHT_M = 0.09
SKIRTING_DEPTH_M = 0.014
WALL_GAP_M = 0.02
WALL_THICKNESS_M = 0.2
# A room has at most this many pieces of furniture, not counting small objects and what windows and ceilings carry.
MAX_FURNITURE = 25
EXTRAS = frozenset(
    {
        "books", "bottles", "bowl", "candles", "ceiling_lamp", "chopping_board", "cup", "curtain", "curtain_rod",
        "kettle", "monitor", "paper_roll", "pendant", "photo", "plates", "small_plant", "soap", "table_lamp",
        "towel_stack", "tray", "tv", "vase",
    }
)  # fmt: skip
# Unit vectors of a quarter turn, exact: furniture must not tilt by rounding.
QUARTER_TURNS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))

Spot = tuple[float, float]


@dataclass(frozen=True)
class Box:
    """Space between two corners of a box along the world's axes."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]

    def overlaps(self, other: "Box", gap_m: float = 0.0) -> bool:
        """Whether the boxes come within ``gap_m`` of each other along the floor, at some common height."""
        gaps = (gap_m, gap_m, -1e-6)
        return all(
            self.low_m[axis] < other.high_m[axis] + gaps[axis] and other.low_m[axis] < self.high_m[axis] + gaps[axis]
            for axis in range(3)
        )


@dataclass(frozen=True)
class Wall:
    """A straight wall, whose inner edge starts at ``start_m`` and runs ``quarters`` quarter turns from +x.

    The room lies to the left of that edge, so a piece with its back to the wall turns by ``quarters`` too. Every
    corner is built by the wall that starts there: ``starts_convex`` says which way it turns.
    """

    start_m: Spot
    length_m: float
    quarters: int
    starts_convex: bool

    def at(self, along_m: float, off_m: float) -> Spot:
        """The point ``along_m`` from the middle of the wall and ``off_m`` into the room."""
        cosine, sine = QUARTER_TURNS[self.quarters]
        x = along_m + 0.5 * self.length_m
        return self.start_m[0] + cosine * x - sine * off_m, self.start_m[1] + sine * x + cosine * off_m

    def along_m(self, spot_m: Spot) -> float:
        """How far along the wall from its middle a point lies."""
        cosine, sine = QUARTER_TURNS[self.quarters]
        return cosine * (spot_m[0] - self.start_m[0]) + sine * (spot_m[1] - self.start_m[1]) - 0.5 * self.length_m

    def off_m(self, spot_m: Spot) -> float:
        """How far into the room, off the wall's inner face, a point lies."""
        cosine, sine = QUARTER_TURNS[self.quarters]
        return cosine * (spot_m[1] - self.start_m[1]) - sine * (spot_m[0] - self.start_m[0])


@dataclass(frozen=True)
class FloorPlan:
    """A rectangle around the origin, or one from which a corner is cut: an L.

    ``notch_m`` holds the cut's extents along the walls that arrive at and leave the corner number ``notch_corner``
    (0 at -x -y, counted counter-clockwise).
    """

    width_m: float
    depth_m: float
    notch_corner: int = 0
    notch_m: Spot | None = None

    @cached_property
    def corners_m(self) -> Float64[np.ndarray, "K 2"]:
        """The inner edge of the walls, counter-clockwise."""
        x, y = 0.5 * self.width_m, 0.5 * self.depth_m
        corners = [np.array(corner) for corner in ((-x, -y), (x, -y), (x, y), (-x, y))]
        if self.notch_m is None:
            return np.array(corners)
        cut = corners[self.notch_corner]
        before = -self.notch_m[0] * np.array(QUARTER_TURNS[self.notch_corner - 1])
        after = self.notch_m[1] * np.array(QUARTER_TURNS[self.notch_corner])
        return np.array(
            [
                *corners[: self.notch_corner],
                cut + before,
                cut + before + after,
                cut + after,
                *corners[self.notch_corner + 1 :],
            ]
        )

    @cached_property
    def walls(self) -> tuple[Wall, ...]:
        """One wall for each corner, starting there."""
        corners = self.corners_m
        walls = []
        for index, corner in enumerate(corners):
            along = corners[(index + 1) % len(corners)] - corner
            arriving = corner - corners[index - 1]
            length_m = float(np.abs(along).sum())
            quarters = QUARTER_TURNS.index((float(np.sign(along[0])), float(np.sign(along[1]))))
            convex = float(arriving[0] * along[1] - arriving[1] * along[0]) > 0.0
            walls.append(Wall((float(corner[0]), float(corner[1])), length_m, quarters, convex))
        return tuple(walls)

    @cached_property
    def notch(self) -> Box | None:
        """The space of the cut corner, at every height."""
        if self.notch_m is None:
            return None
        place = next(index for index, wall in enumerate(self.walls) if not wall.starts_convex)
        ends = self.corners_m[[place - 1, (place + 1) % len(self.corners_m)]]
        low, high = ends.min(0), ends.max(0)
        return Box((float(low[0]), float(low[1]), -1.0), (float(high[0]), float(high[1]), 99.0))

    @property
    def area_m2(self) -> float:
        """The area of the floor."""
        cut = 0.0 if self.notch_m is None else self.notch_m[0] * self.notch_m[1]
        return self.width_m * self.depth_m - cut

    def contains(self, box: Box) -> bool:
        """Whether a box stands inside the walls, up to rounding."""
        half = (0.5 * self.width_m + 1e-9, 0.5 * self.depth_m + 1e-9)
        inside = all(-half[axis] <= box.low_m[axis] and box.high_m[axis] <= half[axis] for axis in range(2))
        return inside and (self.notch is None or not box.overlaps(self.notch, -1e-9))


@dataclass(frozen=True)
class Opening:
    """A hole in the wall of this number: its middle along the wall, and its edges."""

    wall: int
    middle_m: float
    width_m: float
    sill_m: float
    head_m: float


@dataclass(frozen=True)
class Piece:
    """One piece of furniture or decoration.

    In its own frame a piece is ``size_m`` (width, depth, height) large, centred on x = 0, its back on y = 0, its
    front towards +y, its foot on z = 0. It stands at ``position_m``, turned by ``quarters`` quarter turns and
    ``skew_rad`` more. ``detail`` holds numbers in [0, 1) that settle what the size leaves open.
    """

    category: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    quarters: int
    detail: tuple[float, ...]
    skew_rad: float = 0.0

    @property
    def turn(self) -> Spot:
        """Cosine and sine of the turn about the vertical axis."""
        cosine, sine = QUARTER_TURNS[self.quarters % 4]
        if self.skew_rad == 0.0:
            return cosine, sine
        c, s = float(np.cos(self.skew_rad)), float(np.sin(self.skew_rad))
        return cosine * c - sine * s, sine * c + cosine * s

    def to_world(self, x: float, y: float) -> Spot:
        """A point of the piece's own frame on the world's floor plan."""
        cosine, sine = self.turn
        return self.position_m[0] + cosine * x - sine * y, self.position_m[1] + sine * x + cosine * y

    def box(self, front_m: float = 0.0) -> Box:
        """The box along the world's axes around the piece, and around ``front_m`` more before it."""
        half, depth = 0.5 * self.size_m[0], self.size_m[1] + front_m
        corners = [self.to_world(x, y) for x in (-half, half) for y in (0.0, depth)]
        xs, ys = [corner[0] for corner in corners], [corner[1] for corner in corners]
        z = self.position_m[2]
        return Box((min(xs), min(ys), z), (max(xs), max(ys), z + self.size_m[2]))


@dataclass(frozen=True)
class RoomPlan:
    """Everything that was drawn for a room. The origin is on the floor in the middle of the plan's rectangle."""

    kind: str
    floor: FloorPlan
    height_m: float
    door: Opening
    windows: tuple[Opening, ...]
    accent_wall: int
    pieces: tuple[Piece, ...]
    palette: Palette
    lights: tuple[AreaLight, ...]
    sky: Sky
