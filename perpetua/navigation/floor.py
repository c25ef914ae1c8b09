"""The free floor as a graph: shortest ways that prefer the middle of the room to its edges."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float64, Int64
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from perpetua.navigation.types import NavGrid

# Close to obstacles a step costs up to twice its length; the surcharge fades over this distance.
COMFORT_M = 0.15
# A straight line replaces a way over the grid if it costs at most this much more.
SHORTCUT_TOLERANCE = 1.01
SAMPLE_M = 0.03


class WalkableFloor:
    """The free cells of a grid as a graph, in which a step costs its length, and more close to obstacles."""

    def __init__(self, grid: NavGrid) -> None:
        self.grid = grid
        cells = np.argwhere(grid.free)
        self.points_m: Float64[np.ndarray, "N 2"] = grid.origin_m + grid.cell_m * cells
        self.clearance_m = grid.clearance_m[grid.free].astype(np.float64)
        self._tightest_m = float(self.clearance_m.min())
        # The price of a metre, infinite where nobody can stand.
        self._price = np.where(grid.free, self._prices(grid.clearance_m.astype(np.float64)), np.inf)
        self._graph = self._make_graph()

    def _prices(self, clearance_m: Float64[np.ndarray, "..."]) -> Float64[np.ndarray, "..."]:
        return np.asarray(1.0 + np.exp(-np.maximum(clearance_m - self._tightest_m, 0.0) / COMFORT_M))

    def _make_graph(self) -> sparse.csr_array:
        number = np.full(self.grid.free.shape, -1)
        number[self.grid.free] = np.arange(len(self.points_m))
        starts, ends, costs = [], [], []
        for dx, dy in ((1, 0), (0, 1), (1, 1), (1, -1)):
            width, depth = number.shape
            here = number[: width - dx, max(0, -dy) : depth - max(0, dy)].ravel()
            there = number[dx:, max(0, dy) : depth + min(0, dy)].ravel()
            both = (here >= 0) & (there >= 0)
            here, there = here[both], there[both]
            starts.append(here)
            ends.append(there)
            price = self._prices(np.minimum(self.clearance_m[here], self.clearance_m[there]))
            costs.append(self.grid.cell_m * np.hypot(dx, dy) * price)
        pairs = (np.concatenate(starts), np.concatenate(ends))
        return sparse.csr_array((np.concatenate(costs), pairs), shape=(len(self.points_m),) * 2)

    def nearest(self, point_m: Float64[np.ndarray, "2"]) -> int:
        """The free cell nearest to a point."""
        return int(((self.points_m - point_m) ** 2).sum(1).argmin())

    def ways_from(self, cell: int) -> "Ways":
        """The cheapest ways from a cell to all others."""
        cost, before = csgraph.dijkstra(self._graph, directed=False, indices=cell, return_predecessors=True)
        return Ways(self, cell, cost, before.astype(np.int64))

    def line_cost(self, start_m: Float64[np.ndarray, "2"], end_m: Float64[np.ndarray, "2"]) -> float:
        """Cost of the straight line between two points; infinite where it leaves the free floor."""
        length_m = float(np.hypot(*(end_m - start_m)))
        fraction = (np.arange(max(1, round(length_m / SAMPLE_M))) + 0.5) / max(1, round(length_m / SAMPLE_M))
        place = (start_m + fraction[:, None] * (end_m - start_m) - self.grid.origin_m) / self.grid.cell_m
        prices = ndimage.map_coordinates(self._price, place.T, order=0, mode="constant", cval=np.inf)
        return length_m * float(prices.mean())


class Ways:
    """The cheapest ways from one cell: ``cost_m`` per free cell, infinite where none leads."""

    def __init__(
        self, floor: WalkableFloor, start: int, cost_m: Float64[np.ndarray, " N"], before: Int64[np.ndarray, " N"]
    ) -> None:
        self._floor = floor
        self._before = before
        self.start = start
        self.cost_m = cost_m

    def path_m(self, target: int) -> Float64[np.ndarray, "K 2"]:
        """The way to a cell, from cell to cell."""
        cells = [target]
        while cells[-1] != self.start:
            cells.append(int(self._before[cells[-1]]))
        return self._floor.points_m[cells[::-1]]

    def straightened_m(self, target: int) -> Float64[np.ndarray, "K 2"]:
        """The way to a cell with straight lines wherever they cost no more than the way from cell to cell."""
        path_m = self.path_m(target)
        floor = self._floor
        steps = [floor.line_cost(a, b) for a, b in pairwise(path_m)]
        spent = np.append(0.0, np.cumsum(steps))
        corners, here, last = [0], 0, len(path_m) - 1
        while here < last:
            # From far to near; the next cell itself always serves.
            reach = np.unique(np.linspace(here + 1, last, 24).astype(int))[::-1]
            lines = (
                int(end)
                for end in reach
                if floor.line_cost(path_m[here], path_m[end]) <= SHORTCUT_TOLERANCE * (spent[end] - spent[here]) + 1e-9
            )
            here = next(lines, here + 1)
            corners.append(here)
        return path_m[corners]
