"""Counts of entries that were tested and failed, with the first failure in words."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool

from perpetua.audit.report import Check

# Labels of pixels are checked in this many frames of a sequence, evenly spaced.
FRAMES_LOOKED_AT = 16


def chosen_frames(count: int) -> list[int]:
    """The frames, out of ``count``, in which every pixel is checked."""
    chosen: list[int] = np.unique(np.linspace(0, count - 1, min(count, FRAMES_LOOKED_AT)).round().astype(int)).tolist()
    return chosen


def few_enough(failed: int, tested: int, least: float) -> bool:
    """Whether the fraction of entries that keep a rule is at least ``least``.

    Where some may fail, one failure is always allowed: one of 46 entries is 2%, and proves as little as one of 460.
    """
    return failed <= (1.0 - least) * tested + 1e-9 or (least < 1.0 and failed <= 1)


@dataclass
class Tally:
    """Entries of one rule; ``words`` say what the rule is."""

    words: str
    least: float
    tested: int = 0
    failed: int = 0
    first: str = ""

    def add(
        self,
        name: str,
        failed: Bool[np.ndarray, "*any"],
        tested: Bool[np.ndarray, "*any"] | None = None,
        figures: Callable[[int], str] | None = None,
    ) -> None:
        """Counts entries of a file's frame, called ``name``; those not ``tested`` do not count. ``figures`` describes
        the entry at a flat index."""
        bad = failed if tested is None else failed & tested
        self.tested += failed.size if tested is None else int(tested.sum())
        self.failed += int(bad.sum())
        if bad.any() and not self.first:
            place = ", ".join(str(index) for index in np.argwhere(bad)[0])
            more = "" if figures is None else f": {figures(int(np.flatnonzero(bad)[0]))}"
            self.first = f"{name}, {place}] {self.words}{more}"

    @property
    def fraction(self) -> float:
        """The fraction of entries that keep the rule."""
        return 1.0 - self.failed / max(self.tested, 1)

    @property
    def fault(self) -> str:
        """What is wrong; empty where enough entries keep the rule."""
        if few_enough(self.failed, self.tested, self.least):
            return ""
        return f"{self.first} ({self.failed} of {self.tested} entries)"


def check_of(name: str, tallies: list[Tally]) -> Check:
    """One check of several rules; its value is the lowest fraction."""
    faults = [tally.fault for tally in tallies if tally.fault]
    least = min(tally.least for tally in tallies)
    bound = f">= {least:g} of entries" + (", or all but one" if least < 1.0 else "")
    return Check(name, not faults, min(tally.fraction for tally in tallies), bound, "; ".join(faults[:3]))
