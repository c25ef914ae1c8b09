"""How much memory this process may still take: of the machine, and of the control group that a job runs in."""

from pathlib import Path

import psutil

_CGROUP_FOLDER = Path("/sys/fs/cgroup")
# Limit, use, and the share of the use that is cache of files and given back when wanted: version 2, then version 1.
_CGROUP_FILES = (
    ("memory.max", "memory.current", "inactive_file"),
    ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
)


def free_memory_mb() -> float:
    """The least of what the machine has and what every control group around this process leaves, megabytes."""
    return min([psutil.virtual_memory().available / 1e6, *(_left_mb(folder) for folder in _groups())])


def _groups() -> list[Path]:
    """Folders of the groups that this process is in, innermost first."""
    try:
        lines = Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    found: list[Path] = []
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if controllers not in ("", "memory"):
            continue
        root = _CGROUP_FOLDER / controllers
        inner = root / path.lstrip("/")
        # In a container the path may be the host's, of which only the root is seen.
        found += [folder for folder in (inner, *inner.parents) if folder.is_relative_to(root)]
    return found


def _left_mb(folder: Path) -> float:
    for limit_file, use_file, cache_key in _CGROUP_FILES:
        try:
            limit = (folder / limit_file).read_text(encoding="ascii").strip()
            used = int((folder / use_file).read_text(encoding="ascii"))
            statistics = (folder / "memory.stat").read_text(encoding="ascii").split()
        except (OSError, ValueError):
            continue
        if limit != "max":
            cached = int(statistics[statistics.index(cache_key) + 1])
            return (int(limit) - used + cached) / 1e6
    return float("inf")
