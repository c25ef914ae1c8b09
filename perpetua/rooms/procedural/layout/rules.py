"""Where furniture may stand: the rules by which a room's plan grows piece by piece."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from perpetua.rooms.procedural.layout.plan import (
    DETAILS,
    EXTRAS,
    MAX_FURNITURE,
    RUG_THICKNESS_M,
    WALL_GAP_M,
    Box,
    FloorPlan,
    Opening,
    Piece,
    Spot,
)

Size = tuple[float, float, float]
TRIES = 50
DOOR_ZONE_M = 1.1
# Between neighbours that are not meant to touch; wide enough not to look like a mistake.
NEIGHBOUR_GAP_M = 0.06
# What stands under a window ends this far below its sill, so that worktops with tiles behind them do not.
SILL_MARGIN_M = 0.12


class Layout:
    """The pieces placed so far and the space that must stay empty; every method draws from ``rng``."""

    def __init__(self, rng: np.random.Generator, floor: FloorPlan, door: Opening, windows: Sequence[Opening]) -> None:
        self.rng = rng
        self.floor = floor
        self.door = door
        self.windows = tuple(windows)
        self.pieces: list[Piece] = []
        # Space before openings, which stays empty at all heights of the opening, and space before furniture.
        self._openings = [self._before(door, DOOR_ZONE_M)] + [self._before(window, 0.3) for window in windows]
        self._fronts: list[Box] = []

    @property
    def is_full(self) -> bool:
        """Whether the room has as much furniture as it may."""
        return sum(piece.category not in EXTRAS for piece in self.pieces) >= MAX_FURNITURE

    def between(self, low: float, high: float) -> float:
        """A number from a range."""
        return float(self.rng.uniform(low, high))

    def chance(self, fraction: float) -> bool:
        """True in this share of draws."""
        return bool(self.rng.uniform() < fraction)

    def _before(self, opening: Opening, depth_m: float) -> Box:
        half, wall = 0.5 * opening.width_m + 0.08, self.floor.walls[opening.wall]
        x0, y0 = wall.at(opening.middle_m - half, 0.0)
        x1, y1 = wall.at(opening.middle_m + half, depth_m)
        low_z_m, high_z_m = opening.sill_m - SILL_MARGIN_M, opening.head_m + 0.08
        return Box((min(x0, x1), min(y0, y1), low_z_m), (max(x0, x1), max(y0, y1), high_z_m))

    def piece(self, category: str, size_m: Size, position_m: Size, quarters: int, skew_rad: float = 0.0) -> Piece:
        """A piece with details of its own, not placed yet."""
        detail = tuple(float(value) for value in self.rng.uniform(size=DETAILS))
        return Piece(category, size_m, position_m, quarters % 4, detail, skew_rad)

    def fits(self, piece: Piece, front_m: float = 0.0, gap_m: float = NEIGHBOUR_GAP_M) -> bool:
        """Whether the piece is inside the room, clear of other pieces and their fronts, and blocks no opening."""
        box, wide = piece.box(), piece.box(front_m)
        if any(box.overlaps(front) for front in self._fronts) or not self._is_clear(box, gap_m):
            return False
        # A rug may lie before a piece, but nothing may stand on its edge.
        return not any(wide.overlaps(other.box(), gap_m) for other in self.pieces if other.category != "rug")

    def _is_clear(self, box: Box, gap_m: float) -> bool:
        """Whether a box is inside the room, before no opening, and clear of all pieces."""
        if not self.floor.contains(box) or any(box.overlaps(opening) for opening in self._openings):
            return False
        return not any(box.overlaps(other.box(), gap_m) for other in self.pieces)

    def add(self, piece: Piece, front_m: float = 0.0) -> Piece:
        """Places the piece; ``front_m`` before it stays empty from now on."""
        self.pieces.append(piece)
        if front_m > 0.0:
            self._fronts.append(piece.box(front_m))
        return piece

    def try_add(self, piece: Piece, gap_m: float = NEIGHBOUR_GAP_M) -> Piece | None:
        """Places the piece if it fits."""
        return self.add(piece) if self.fits(piece, gap_m=gap_m) else None

    def put(self, obj: Piece) -> Piece | None:
        """Places a small object on furniture, where fronts do not count, if nothing else is in its way."""
        return self.add(obj) if self._is_clear(obj.box(), 0.004) else None

    def keep_empty(self, box: Box) -> None:
        """Nothing is placed in this box from now on."""
        self._openings.append(box)

    def at_wall(
        self,
        category: str,
        size_m: Size,
        front_m: float = 0.0,
        walls: Sequence[int] | None = None,
        corner: bool = False,
        z_m: float = 0.0,
        off_m: float = WALL_GAP_M,
    ) -> Piece | None:
        """A piece with its back to one of the walls, anywhere along it or in a corner.

        None if it fits nowhere, or if the room has as much furniture as it may.
        """
        if self.is_full:
            return None
        numbers = range(len(self.floor.walls)) if walls is None else walls
        long_enough = [number for number in numbers if self.floor.walls[number].length_m > size_m[0] + 2 * WALL_GAP_M]
        if not long_enough:
            return None
        for _ in range(TRIES):
            wall = self.floor.walls[int(self.rng.choice(long_enough))]
            reach_m = 0.5 * (wall.length_m - size_m[0]) - WALL_GAP_M
            along_m = float(self.rng.choice([-reach_m, reach_m]) if corner else self.rng.uniform(-reach_m, reach_m))
            candidate = self.piece(category, size_m, (*wall.at(along_m, off_m), z_m), wall.quarters)
            if self.fits(candidate, front_m):
                return self.add(candidate, front_m)
        return None

    def facing(self, anchor: Piece, category: str, size_m: Size, front_m: float, reach_m: float) -> Piece | None:
        """A piece at a wall within reach that ``anchor`` looks at, opposite its middle or a little aside."""
        for aside_m in (0.0, -0.3, 0.3, -0.6, 0.6):
            for number in self._walls_ahead(anchor, reach_m):
                wall = self.floor.walls[number]
                along_m = wall.along_m(anchor.to_world(aside_m, 0.0))
                if abs(along_m) > 0.5 * (wall.length_m - size_m[0]) - WALL_GAP_M:
                    continue
                candidate = self.piece(category, size_m, (*wall.at(along_m, WALL_GAP_M), 0.0), wall.quarters)
                if self.fits(candidate, front_m):
                    return self.add(candidate, front_m)
        return None

    def _walls_ahead(self, anchor: Piece, reach_m: float) -> list[int]:
        """The walls that a piece looks at from within reach, the nearest first."""
        front = anchor.to_world(0.0, anchor.size_m[1])
        ahead = [
            (wall.off_m(front), number)
            for number, wall in enumerate(self.floor.walls)
            if wall.quarters == (anchor.quarters + 2) % 4 and 0.0 < wall.off_m(front) < reach_m
        ]
        return [number for _, number in sorted(ahead)]

    def beside(
        self, anchor: Piece, category: str, size_m: Size, gap_m: float = 0.08, clear_m: float = NEIGHBOUR_GAP_M
    ) -> Piece | None:
        """A piece at the left or right of another, backs aligned; None if it fits on neither side."""
        reach_m = 0.5 * (anchor.size_m[0] + size_m[0]) + gap_m
        for side in self.rng.permutation([-1.0, 1.0]):
            x, y = anchor.to_world(float(side) * reach_m, 0.0)
            candidate = self.piece(category, size_m, (x, y, 0.0), anchor.quarters)
            if self.try_add(candidate, clear_m) is not None:
                return candidate
        return None

    def around(
        self,
        anchor: Piece,
        category: str,
        size_m: Size,
        x_m: float,
        y_m: float,
        quarters: int,
        gap_m: float = 0.02,
        skew_rad: float = 0.0,
    ) -> Piece | None:
        """A piece at a place of another's own frame, turned relative to it; None if it does not fit.

        It shares the other's details, so that all that stands around one object makes a set.
        """
        position_m = (*anchor.to_world(x_m, y_m), 0.0)
        candidate = Piece(category, size_m, position_m, (anchor.quarters + quarters) % 4, anchor.detail, skew_rad)
        return self.try_add(candidate, gap_m)

    def free_standing(
        self, category: str, size_m: Size, around_m: float, quarters: Sequence[int] = (0, 1, 2, 3)
    ) -> Piece | None:
        """A piece away from the walls with ``around_m`` of floor around it; None if it fits nowhere."""
        low, high = self.floor.corners_m.min(0), self.floor.corners_m.max(0)
        for _ in range(TRIES):
            quarter = int(self.rng.choice(list(quarters)))
            centre = self.rng.uniform(low, high)
            off = Piece(category, size_m, (0.0, 0.0, 0.0), quarter, ()).to_world(0.0, 0.5 * size_m[1])
            position = (float(centre[0]) - off[0], float(centre[1]) - off[1], 0.0)
            candidate = self.piece(category, size_m, position, quarter)
            box = candidate.box()
            zone = Box(
                (box.low_m[0] - around_m, box.low_m[1] - around_m, 0.0),
                (box.high_m[0] + around_m, box.high_m[1] + around_m, 1.0),
            )
            if self.floor.contains(zone) and self.fits(candidate, gap_m=around_m):
                return self.add(candidate)
        return None

    def on_top(
        self, surface: Piece, category: str, size_m: Size, x_m: float, y_m: float, skew_rad: float = 0.0
    ) -> Piece | None:
        """A small object standing on another piece, centred at a place of that piece's own frame, if it fits."""
        turn = Piece(category, size_m, (0.0, 0.0, 0.0), surface.quarters, (), skew_rad)
        off = turn.to_world(0.0, 0.5 * size_m[1])
        x, y = surface.to_world(x_m, y_m)
        position = (x - off[0], y - off[1], surface.position_m[2] + surface.size_m[2])
        return self.put(self.piece(category, size_m, position, surface.quarters, skew_rad))

    def on_wall(self, anchor: Piece, category: str, size_m: Size, z_m: float, x_m: float = 0.0) -> Piece | None:
        """An object on the wall behind a piece that stands at it; None where something is in the way."""
        x, y = anchor.to_world(x_m, -WALL_GAP_M)
        candidate = self.piece(category, size_m, (x, y, z_m), anchor.quarters)
        return None if self.is_full else self.try_add(candidate, 0.03)

    def rug(self, size_m: Spot, centre_m: Spot, quarters: int) -> Piece | None:
        """A rug: what stands wholly on it is lifted by its thickness; None if anything would stand on its edge."""
        size = (size_m[0], size_m[1], RUG_THICKNESS_M)
        x, y = Piece("rug", size, (*centre_m, 0.0), quarters % 4, ()).to_world(0.0, -0.5 * size_m[1])
        candidate = self.piece("rug", size, (x, y, 0.0), quarters)
        box = candidate.box()
        roomy = Box((box.low_m[0] - 0.06, box.low_m[1] - 0.06, 0.0), (box.high_m[0] + 0.06, box.high_m[1] + 0.06, 0.01))
        if not self.floor.contains(roomy):
            return None
        touched = [other for other in self.pieces if other.position_m[2] < 0.02 and box.overlaps(other.box(), 0.02)]
        if not all(_holds(box, other.box()) and other.category != "rug" for other in touched):
            return None
        for index, piece in enumerate(self.pieces):
            if _holds(box, piece.box()):
                x, y, z = piece.position_m
                self.pieces[index] = replace(piece, position_m=(x, y, z + RUG_THICKNESS_M))
        return self.add(candidate)

    def placed(self, piece: Piece) -> Piece:
        """The piece as it stands now: a rug may have lifted it since."""
        return next(other for other in self.pieces if other.detail is piece.detail and other.category == piece.category)


def _holds(outer: Box, inner: Box) -> bool:
    return all(
        outer.low_m[axis] + 0.02 <= inner.low_m[axis] and inner.high_m[axis] <= outer.high_m[axis] - 0.02
        for axis in range(2)
    )
