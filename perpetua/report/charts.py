"""Bars of a chart, placed; the page's template draws them as SVG."""

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Int64


@dataclass(frozen=True)
class Bar:
    """A bar of a chart: what it counts, its count, its part of all, and its length as a part of the longest one."""

    label: str
    count: int
    fraction: float
    length: float


@dataclass(frozen=True)
class Chart:
    """A chart: ``bars`` from left to right, or from top to bottom where ``rows``.

    ``ticks`` stand between bars of a scale, one more than there are bars; none where each bar has its label.
    """

    title: str
    note: str
    bars: tuple[Bar, ...]
    ticks: tuple[str, ...] = ()
    rows: bool = False

    @property
    def total(self) -> int:
        """Sum of the counts of all bars."""
        return sum(bar.count for bar in self.bars)


def histogram(title: str, note: str, counts: Int64[np.ndarray, " _"], edges: tuple[float, ...], unit: str) -> Chart:
    """Bars between the edges of a scale; empty ones at its ends are left out."""
    first, last = _filled(counts)
    ticks = tuple("more" if math.isinf(edge) else f"{edge:g}" for edge in edges[first : last + 2])
    labels = [_between(low, high, unit) for low, high in pairwise(edges)][first : last + 1]
    return Chart(title, note, _bars(labels, counts[first : last + 1]), ticks)


def tally(title: str, note: str, counts: Int64[np.ndarray, " _"], what: str) -> Chart:
    """A bar for each number from 0; a bar at the end of the scale also holds all larger numbers."""
    _, last = _filled(counts)
    labels = [f"{number} {what}" for number in range(last + 1)]
    ticks = [str(number) for number in range(last + 1)]
    if last == len(counts) - 1:
        labels[-1], ticks[-1] = f"{last} {what} or more", f"{last}+"
    bars = _bars(labels, counts[: last + 1])
    return Chart(title, note, bars, tuple(ticks))


def named(title: str, note: str, counts: dict[str, int], most: int = 16) -> Chart:
    """A row for each name, the most frequent first; names beyond ``most`` rows share one row."""
    ordered = sorted(counts.items(), key=lambda item: (-item[1], item[0]))
    shown, rest = ordered[:most], ordered[most:]
    if rest:
        shown.append((f"{len(rest)} others", sum(count for _, count in rest)))
    return Chart(title, note, _bars([name for name, _ in shown], np.array([count for _, count in shown])), rows=True)


def fractions(title: str, note: str, values: dict[str, float]) -> Chart:
    """A row for each name, as long as its fraction."""
    bars = tuple(Bar(name, 0, fraction, fraction) for name, fraction in values.items())
    return Chart(title, note, bars, rows=True)


def _filled(counts: Int64[np.ndarray, " _"]) -> tuple[int, int]:
    places = np.flatnonzero(counts)
    return (int(places[0]), int(places[-1])) if len(places) else (0, len(counts) - 1)


def _between(low: float, high: float, unit: str) -> str:
    return f"{low:g} {unit} or more" if math.isinf(high) else f"{low:g} to {high:g} {unit}"


def _bars(labels: list[str], counts: np.ndarray) -> tuple[Bar, ...]:
    total, most = max(int(counts.sum()), 1), max(int(counts.max(initial=0)), 1)
    return tuple(
        Bar(label, int(count), int(count) / total, int(count) / most)
        for label, count in zip(labels, counts.tolist(), strict=True)
    )
