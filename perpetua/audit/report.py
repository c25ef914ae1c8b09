"""What an audit found."""

import math
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.table import Table


@dataclass(frozen=True)
class Check:
    """One rule: the value found, the bound it must keep, and, where it fails, the file, the index and the value."""

    name: str
    passed: bool
    value: float
    bound: str
    detail: str

    def __str__(self) -> str:
        return f"{self.name}: {self.detail}" if self.detail else f"{self.name}: {self.value:.6g} ({self.bound})"


@dataclass(frozen=True)
class AuditReport:
    """All checks of one sequence. ``skipped`` names the checks that the files do not allow, with the reason."""

    folder: Path
    checks: tuple[Check, ...]
    skipped: tuple[str, ...]

    @property
    def passed(self) -> bool:
        """Whether every check that ran holds."""
        return all(check.passed for check in self.checks)

    def to_json(self) -> dict[str, Any]:
        """The report as JSON values, without the folder, so that equal sequences give equal reports."""
        return {
            "passed": self.passed,
            "checks": [
                asdict(check) | {"value": check.value if math.isfinite(check.value) else None} for check in self.checks
            ],
            "skipped": list(self.skipped),
        }

    def table(self) -> Table:
        """The report for a terminal."""
        verdict = "passed" if self.passed else "FAILED"
        table = Table(title=f"{self.folder}: {verdict}", title_justify="left")
        for heading in ("check", "", "value", "bound", "detail"):
            table.add_column(heading, overflow="fold")
        for check in self.checks:
            mark = "[green]ok[/green]" if check.passed else "[red]FAIL[/red]"
            table.add_row(check.name, mark, f"{check.value:.6g}", check.bound, check.detail)
        for line in self.skipped:
            table.add_row(line.partition(":")[0], "-", "", "", line.partition(":")[2].strip())
        return table
