"""Counts of what pixels and rules of visibility say against exact rays, and the tables made of them."""

from collections import Counter

from pixel_agreement import HEADINGS, PixelCount
from visibility_sheet import Example

COUNTED = ("entries", "on image", "wrongly visible", "wrongly hidden", "of these in no pixel")
GROUPS = ("all", "static", "moving")


class Ledger:
    """Counts of pixels; of entries by rule and group of tracks; disagreements by kind (on the image), and some examples
    of each kind."""

    def __init__(self, rules: list[str], examples: int) -> None:
        self.rules = rules
        self.pixels = PixelCount()
        self.counts: Counter[tuple[str, str, str]] = Counter()
        self.kinds: Counter[tuple[str, str]] = Counter()
        self.examples: dict[tuple[str, str], list[Example]] = {}
        self.wanted = examples

    def enter(self, rule: str, group: str, counted: dict[str, int]) -> None:
        """Adds counts."""
        for name, count in counted.items():
            self.counts[rule, group, name] += count

    def show(self, rule: str, kind: str, example: Example) -> None:
        """Counts a disagreement, and keeps it as an example while few of its kind are kept, each from another image."""
        self.kinds[rule, kind] += 1
        kept = self.examples.setdefault((rule, kind), [])
        if len(kept) < self.wanted and all(example.image != other.image for other in kept):
            kept.append(example)

    def add(self, other: "Ledger") -> None:
        """Takes in what another ledger counted."""
        self.pixels = self.pixels + other.pixels
        self.counts.update(other.counts)
        self.kinds.update(other.kinds)
        for key, examples in other.examples.items():
            kept = self.examples.setdefault(key, [])
            kept += examples[: max(self.wanted - len(kept), 0)]

    def agreement(self, rule: str, group: str = "all") -> list[str]:
        """Entries and those on the image, agreement of a rule over both, and what is wrong."""
        counts = {name: self.counts[rule, group, name] for name in COUNTED}
        wrong = counts["wrongly visible"] + counts["wrongly hidden"]
        fractions = [f"{100 * (1.0 - wrong / max(counts[name], 1)):.3f}%" for name in COUNTED[:2]]
        numbers = [str(count) for count in counts.values()]
        return [*numbers[:2], *fractions, *numbers[2:]]

    def in_order(self) -> list[tuple[str, str]]:
        """Rules and kinds that occurred, rule by rule."""
        return sorted(self.kinds, key=lambda key: (self.rules.index(key[0]), key[1]))


def _print_row(*cells: str) -> None:
    print(f"| {' | '.join(cells)} |")


def _print_heading(*cells: str) -> None:
    _print_row(*cells)
    _print_row(*(["---"] * len(cells)))


def print_sequences(ledgers: dict[str, Ledger]) -> None:
    """Pixels and the stored visibility, sequence by sequence."""
    _print_heading("sequence", *HEADINGS, "entries", "visibility", "wrongly visible", "wrongly hidden")
    for name, ledger in ledgers.items():
        entries, _, agreement, _, visible, hidden, _ = ledger.agreement("stored")
        _print_row(name, *ledger.pixels.cells(), entries, agreement, visible, hidden)


def print_rules(ledger: Ledger) -> None:
    """Rules by groups of tracks, and kinds of disagreement."""
    print()
    _print_heading("rule", "tracks", *COUNTED[:2], "agreement", "agreement on image", *COUNTED[2:])
    for rule in ledger.rules:
        for group in GROUPS:
            _print_row(rule, group, *ledger.agreement(rule, group))
    print()
    _print_heading("rule", "kind of disagreement", "entries")
    for rule, kind in ledger.in_order():
        _print_row(rule, kind, str(ledger.kinds[rule, kind]))
