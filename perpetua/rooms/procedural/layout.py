"""Where furniture may stand: the rules by which a room's plan grows piece by piece."""

from collections.abc import Sequence

import numpy as np

from perpetua.rooms.procedural.plan import (
    DETAILS,
    RUG_THICKNESS_M,
    WALL_GAP_M,
    Box,
    Opening,
    Piece,
    at_wall,
    wall_length_m,
)

Size = tuple[float, float, float]
TRIES = 60
DOOR_ZONE_M = 1.1
# Between neighbours that are not meant to touch; wide enough not to look like a mistake.
NEIGHBOUR_GAP_M = 0.06


class Layout:
    """The pieces placed so far and the space that must stay empty; every method draws from ``rng``."""

    def __init__(
        self, rng: np.random.Generator, width_m: float, depth_m: float, door: Opening, windows: Sequence[Opening]
    ) -> None:
        self.rng = rng
        self.width_m = width_m
        self.depth_m = depth_m
        self.door = door
        self.pieces: list[Piece] = []
        self._empty = [self._before(door, DOOR_ZONE_M)] + [self._before(window, 0.3) for window in windows]

    def _before(self, opening: Opening, depth_m: float) -> Box:
        half = 0.5 * opening.width_m
        x0, y0 = at_wall(opening.wall, opening.middle_m - half, 0.0, self.width_m, self.depth_m)
        x1, y1 = at_wall(opening.wall, opening.middle_m + half, depth_m, self.width_m, self.depth_m)
        return Box((min(x0, x1), min(y0, y1), opening.sill_m), (max(x0, x1), max(y0, y1), opening.head_m))

    def piece(self, category: str, size_m: Size, position_m: Size, quarters: int) -> Piece:
        """A piece with details of its own, not placed yet."""
        detail = tuple(float(value) for value in self.rng.uniform(size=DETAILS))
        return Piece(category, size_m, position_m, quarters % 4, detail)

    def fits(self, piece: Piece, front_m: float = 0.0, gap_m: float = NEIGHBOUR_GAP_M) -> bool:
        """Whether the piece is inside the room, clear of other pieces, and blocks no door or window."""
        box = piece.box()
        half = (0.5 * self.width_m, 0.5 * self.depth_m)
        inside = all(
            -half[axis] - 1e-9 <= box.low_m[axis] and box.high_m[axis] <= half[axis] + 1e-9 for axis in range(2)
        )
        clear = not any(box.overlaps(empty) for empty in self._empty)
        if not (inside and clear):
            return False
        wide = piece.box(front_m)
        return not any(wide.overlaps(other.box(), gap_m) for other in self.pieces if other.category != "rug")

    def add(self, piece: Piece, front_m: float = 0.0) -> Piece:
        """Places the piece; ``front_m`` before it stays empty from now on."""
        self.pieces.append(piece)
        if front_m > 0.0:
            self._empty.append(piece.box(front_m))
        return piece

    def at_wall(
        self,
        category: str,
        size_m: Size,
        front_m: float = 0.0,
        walls: Sequence[int] = (0, 1, 2, 3),
        corner: bool = False,
        z_m: float = 0.0,
        off_m: float = WALL_GAP_M,
    ) -> Piece | None:
        """A piece with its back to one of the walls, anywhere along it or in a corner; None if it fits nowhere."""
        for _ in range(TRIES):
            wall = int(self.rng.choice(list(walls)))
            reach_m = 0.5 * wall_length_m(wall, self.width_m, self.depth_m) - 0.5 * size_m[0] - WALL_GAP_M
            if reach_m < 0.0:
                continue
            along_m = float(self.rng.choice([-reach_m, reach_m]) if corner else self.rng.uniform(-reach_m, reach_m))
            x, y = at_wall(wall, along_m, off_m, self.width_m, self.depth_m)
            candidate = self.piece(category, size_m, (x, y, z_m), wall)
            if self.fits(candidate, front_m):
                return self.add(candidate, front_m)
        return None

    def beside(self, anchor: Piece, category: str, size_m: Size, gap_m: float = 0.08) -> Piece | None:
        """A piece at the left or right of another, backs aligned; None if it fits on neither side."""
        reach_m = 0.5 * (anchor.size_m[0] + size_m[0]) + gap_m
        for side in self.rng.permutation([-1.0, 1.0]):
            x, y = anchor.to_world(float(side) * reach_m, 0.0)
            candidate = self.piece(category, size_m, (x, y, 0.0), anchor.quarters)
            if self.fits(candidate):
                return self.add(candidate)
        return None

    def around(
        self, anchor: Piece, category: str, size_m: Size, x_m: float, y_m: float, quarters: int, gap_m: float = 0.02
    ) -> Piece | None:
        """A piece at a place of another's own frame, turned relative to it; None if it does not fit.

        It shares the other's details, so that all that stands around one thing makes a set.
        """
        x, y = anchor.to_world(x_m, y_m)
        position_m = (x, y, 0.0)
        candidate = Piece(category, size_m, position_m, (anchor.quarters + quarters) % 4, anchor.detail)
        return self.add(candidate) if self.fits(candidate, gap_m=gap_m) else None

    def free_standing(self, category: str, size_m: Size, around_m: float) -> Piece | None:
        """A piece away from the walls with ``around_m`` of floor around it; None if it fits nowhere."""
        for _ in range(TRIES):
            quarters = int(self.rng.integers(4))
            half_x = 0.5 * (size_m[0] if quarters % 2 == 0 else size_m[1]) + around_m
            half_y = 0.5 * (size_m[1] if quarters % 2 == 0 else size_m[0]) + around_m
            if 2 * half_x > self.width_m or 2 * half_y > self.depth_m:
                continue
            x = float(self.rng.uniform(half_x - 0.5 * self.width_m, 0.5 * self.width_m - half_x))
            y = float(self.rng.uniform(half_y - 0.5 * self.depth_m, 0.5 * self.depth_m - half_y))
            centred = Piece(category, size_m, (x, y, 0.0), quarters, ())
            back_x, back_y = centred.to_world(0.0, -0.5 * size_m[1])
            candidate = self.piece(category, size_m, (back_x, back_y, 0.0), quarters)
            if self.fits(candidate, gap_m=around_m):
                return self.add(candidate)
        return None

    def on_top(self, surface: Piece, category: str, size_m: Size, x_m: float, y_m: float, quarters: int = 0) -> Piece:
        """A small thing standing on another piece, at a place of that piece's own frame."""
        x, y = surface.to_world(x_m, y_m)
        z = surface.position_m[2] + surface.size_m[2]
        return self.add(self.piece(category, size_m, (x, y, z), surface.quarters + quarters))

    def above(self, anchor: Piece, category: str, size_m: Size, z_m: float) -> Piece | None:
        """A thing on the wall behind a piece; None where a window or something else is in the way."""
        x, y = anchor.to_world(0.0, -WALL_GAP_M)
        candidate = self.piece(category, size_m, (x, y, z_m), anchor.quarters)
        return self.add(candidate) if self.fits(candidate) else None

    def rug(self, size_m: tuple[float, float], centre_m: tuple[float, float], quarters: int) -> Piece | None:
        """A rug: what stands wholly on it is lifted by its thickness; None if anything would stand on its edge."""
        size = (size_m[0], size_m[1], RUG_THICKNESS_M)
        flat = Piece("rug", size, (*centre_m, 0.0), quarters % 4, ())
        x, y = flat.to_world(0.0, -0.5 * size_m[1])
        candidate = self.piece("rug", size, (x, y, 0.0), quarters)
        box = candidate.box()
        half = (0.5 * self.width_m - 0.1, 0.5 * self.depth_m - 0.1)
        if any(box.low_m[axis] < -half[axis] or box.high_m[axis] > half[axis] for axis in range(2)):
            return None
        touched = [other for other in self.pieces if other.position_m[2] == 0.0 and box.overlaps(other.box(), 0.02)]
        if not all(_holds(box, other.box()) for other in touched):
            return None
        self._lift(box)
        return self.add(candidate)

    def _lift(self, rug: Box) -> None:
        for index, piece in enumerate(self.pieces):
            if _holds(rug, piece.box()):
                x, y, z = piece.position_m
                lifted = (x, y, z + RUG_THICKNESS_M)
                self.pieces[index] = Piece(piece.category, piece.size_m, lifted, piece.quarters, piece.detail)


def _holds(outer: Box, inner: Box) -> bool:
    return all(
        outer.low_m[axis] + 0.02 <= inner.low_m[axis] and inner.high_m[axis] <= outer.high_m[axis] - 0.02
        for axis in range(2)
    )
