"""What a procedural room consists of before anything is built."""

from dataclasses import dataclass

import numpy as np

from perpetua.rooms.procedural.palette import Palette

DETAILS = 24
RUG_THICKNESS_M = 0.01
SKIRTING_HEIGHT_M = 0.08
SKIRTING_DEPTH_M = 0.012
WALL_GAP_M = 0.025
# Unit vectors of a quarter turn, exact: furniture must not tilt by rounding.
QUARTER_TURNS = ((1, 0), (0, 1), (-1, 0), (0, -1))


@dataclass(frozen=True)
class Opening:
    """A hole in a wall: wall 0 to 3, middle along the wall, and its edges."""

    wall: int
    middle_m: float
    width_m: float
    sill_m: float
    head_m: float


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
class Piece:
    """One piece of furniture or decoration.

    In its own frame a piece is ``size_m`` (width, depth, height) large, centred on x = 0, its back on y = 0, its
    front towards +y, its foot on z = 0. It stands at ``position_m``, turned by ``quarters`` quarter turns.
    ``detail`` holds numbers in [0, 1) that settle what the size leaves open.
    """

    category: str
    size_m: tuple[float, float, float]
    position_m: tuple[float, float, float]
    quarters: int
    detail: tuple[float, ...]

    @property
    def turn_rad(self) -> float:
        """The turn about the vertical axis."""
        return 0.5 * np.pi * self.quarters

    def to_world(self, x: float, y: float) -> tuple[float, float]:
        """A point of the piece's own frame on the world's floor plan."""
        cosine, sine = QUARTER_TURNS[self.quarters % 4]
        return self.position_m[0] + cosine * x - sine * y, self.position_m[1] + sine * x + cosine * y

    def box(self, front_m: float = 0.0) -> Box:
        """The space that the piece takes, and ``front_m`` more before it."""
        half = 0.5 * self.size_m[0]
        x0, y0 = self.to_world(-half, 0.0)
        x1, y1 = self.to_world(half, self.size_m[1] + front_m)
        z = self.position_m[2]
        return Box((min(x0, x1), min(y0, y1), z), (max(x0, x1), max(y0, y1), z + self.size_m[2]))


@dataclass(frozen=True)
class RoomPlan:
    """Everything that was drawn for a room. The origin is on the floor in the middle."""

    kind: str
    width_m: float
    depth_m: float
    height_m: float
    wall_thickness_m: float
    door: Opening
    windows: tuple[Opening, ...]
    pieces: tuple[Piece, ...]
    palette: Palette
    lamp_power_w: float
    daylight_power_w: float
    lamp_color: tuple[float, float, float]
    daylight_color: tuple[float, float, float]


def wall_length_m(wall: int, width_m: float, depth_m: float) -> float:
    """Length of a wall; walls 0 to 3 lie at -y, +x, +y and -x."""
    return width_m if wall % 2 == 0 else depth_m


def wall_distance_m(wall: int, width_m: float, depth_m: float) -> float:
    """Distance of a wall from the middle of the room."""
    return 0.5 * (depth_m if wall % 2 == 0 else width_m)


def at_wall(wall: int, along_m: float, off_m: float, width_m: float, depth_m: float) -> tuple[float, float]:
    """The point ``along_m`` a wall from its middle and ``off_m`` into the room.

    A piece with its back to the wall turns ``wall`` quarters.
    """
    cosine, sine = QUARTER_TURNS[wall]
    y = off_m - wall_distance_m(wall, width_m, depth_m)
    return cosine * along_m - sine * y, sine * along_m + cosine * y
