"""Figures of a whole data set: charts, checks, costs, and the comparison with the reference data."""

import math
from collections import Counter, defaultdict
from dataclasses import dataclass
from functools import reduce
from operator import add
from statistics import mean, median

import numpy as np

from perpetua.report import scales
from perpetua.report.charts import Chart, fractions, histogram, named, tally
from perpetua.report.gather import SequenceFigures
from perpetua.report.measure import Measured
from perpetua.report.records import CheckRecord


@dataclass(frozen=True)
class Comparison:
    """A figure of the reference data beside ours."""

    what: str
    reference: str
    ours: str


@dataclass(frozen=True)
class CheckRow:
    """One check over all sequences that have it: the range of its value, its bound, how many passed."""

    name: str
    bound: str
    least: float | None
    most: float | None
    passed: int
    checked: int
    failures: tuple[str, ...]


@dataclass(frozen=True)
class StageRow:
    """What a stage cost per sequence, and the most memory that it took."""

    stage: str
    median_s: float
    longest_s: float
    most_memory_mb: float
    sequences: int
    fraction: float


def compare(figures: list[SequenceFigures]) -> list[Comparison]:
    """Ours beside the published figures of the reference data."""
    good = _measured(figures)
    tracks = max(sum(one.tracks for one in good), 1)
    moving, fast = sum(one.moving for one in good) / tracks, sum(one.fast for one in good) / tracks
    depths_m = [metres for one in good for metres in one.depth_m if math.isfinite(metres)]
    return [
        Comparison("scenes", "21", f"{len(good):,}"),
        Comparison("views of a scene", "4", _range([len(one.visible_fraction) for one in good])),
        Comparison("frames", "240", _range([one.frames for one in good])),
        Comparison("longer side of the image, px", "512", _range([max(one.size_px) for one in good])),
        Comparison("tracks of a scene", "1,024", _range([one.tracks for one in good])),
        Comparison("tracks that move more than 5 cm", "30.5%", f"{moving:.1%}"),
        Comparison("tracks that move more than 2 m within 24 frames", "hardly any", f"{fast:.2%}"),
        Comparison(
            "distance of cameras from the world's origin, m",
            "2 to 22",
            _range([metres for one in good for metres in one.origin_m], 1),
        ),
        Comparison("depth, m", "outliers seen through windows", _range(depths_m, 1)),
    ]


def _measured(figures: list[SequenceFigures]) -> list[Measured]:
    return [one.measured for one in figures if one.measured is not None]


def _range(values: list[int] | list[float], digits: int = 0) -> str:
    if not values:
        return "unknown"
    least, most = f"{min(values):,.{digits}f}", f"{max(values):,.{digits}f}"
    return least if least == most else f"{least} to {most}"


def charts(figures: list[SequenceFigures]) -> list[Chart]:
    """Every distribution that the sequences allow."""
    good = _measured(figures)
    drawn = _counted_charts(reduce(add, [one.counts for one in good])) if good else []
    drawn += [_heights_chart(figures), *_named_charts(figures, good)]
    return [chart for chart in drawn if chart.bars and (chart.total or any(bar.fraction for bar in chart.bars))]


def _heights_chart(figures: list[SequenceFigures]) -> Chart:
    heights_cm = np.array([height for one in figures for height in one.heights_cm])
    counts = scales.binned(heights_cm, scales.HEIGHT_CM)
    return histogram("Heights of people", "cm", counts, scales.HEIGHT_CM, "cm")


def _counted_charts(counts: scales.Counts) -> list[Chart]:
    return [
        histogram("How far tracks move", "m from where the track was first",
                  counts.travel, scales.TRAVEL_M, "m"),
        histogram("Speed of moving tracks", "m/s, each moving track at each frame",
                  counts.speed, scales.SPEED_MPS, "m/s"),
        tally("Views that see a track", "each track at each frame", counts.seeing_views, "views"),
        histogram("How long tracks are seen", "share of the frames in which any view sees a track",
                  counts.seen_fraction, scales.SEEN_FRACTION, "of the frames"),
        tally("Occlusions", "how often a track is hidden while on the image; tracks by views that see them",
              counts.occlusions, "times"),
        histogram("Depth", "m, pixels with a surface", counts.depth, scales.DEPTH_M, "m"),
        histogram("Focal lengths", "as fields of view: degrees across the image; views",
                  counts.field_of_view, scales.FIELD_OF_VIEW_DEG, "degrees"),
        histogram("Angle between views", "degrees between the optical axes of two views at the same frame",
                  counts.apart, scales.APART_DEG, "degrees"),
    ]  # fmt: skip


def _named_charts(figures: list[SequenceFigures], good: list[Measured]) -> list[Chart]:
    by_view: dict[str, list[float]] = defaultdict(list)
    for one in good:
        for view, fraction in enumerate(one.visible_fraction):
            by_view[f"view {view}"].append(fraction)
    seen = {view: mean(values) for view, values in by_view.items()}
    clothes = Counter(garment for one in figures for garment in one.garments)
    kinds = Counter(one.record.room_kind for one in figures if one.record.room_kind)
    return [
        fractions("Visible in each view", "share of tracks and frames that a view sees", seen),
        named("Clothes", "pieces worn, by people", clothes),
        named("Rooms", "sequences by kind of room", kinds),
    ]


def check_rows(figures: list[SequenceFigures]) -> list[CheckRow]:
    """Each rule of the audits, in their order."""
    found: dict[tuple[str, str], list[tuple[str, CheckRecord]]] = defaultdict(list)
    for one in figures:
        for check in one.checks:
            found[check.name, check.bound].append((one.name, check))
    rows = []
    for (name, bound), results in found.items():
        values = [check.value for _, check in results if check.value is not None]
        failures = tuple(sequence for sequence, check in results if not check.passed)
        rows.append(
            CheckRow(
                name, bound, min(values, default=None), max(values, default=None), len(results) - len(failures),
                len(results), failures,
            )
        )  # fmt: skip
    return rows


def stage_rows(figures: list[SequenceFigures]) -> list[StageRow]:
    """What each stage cost, in the order in which stages were first finished."""
    known = [one.stages for one in figures if one.stages]
    total = sum(event.seconds for stages in known for event in stages.values()) or 1.0
    rows = []
    for name in dict.fromkeys(name for stages in known for name in stages):
        events = [stages[name] for stages in known if name in stages]
        seconds = [event.seconds for event in events]
        memory_mb = max(event.peak_memory_mb for event in events)
        rows.append(StageRow(name, median(seconds), max(seconds), memory_mb, len(events), sum(seconds) / total))
    return rows
