"""Checks a sequence on disk with code of its own: nothing here is shared with what made the data, the reader of
pickled JPEG arrays aside. It also takes data from elsewhere, as far as its files allow."""

from pathlib import Path

from perpetua.audit.array_checks import check_cameras, check_finite, check_hashes, check_images
from perpetua.audit.config import AuditConfig
from perpetua.audit.deep import verify_deep
from perpetua.audit.deep_scene import DeepScene
from perpetua.audit.files import RECORD_FILE, SequenceFiles, load_files
from perpetua.audit.report import AuditReport, Check
from perpetua.audit.track_checks import (
    check_moving_share,
    check_on_surface,
    check_query_draw,
    check_query_pixels,
    check_static,
    track_table,
)
from perpetua.audit.visibility_checks import check_visibility
from perpetua.errors import SequenceFormatError

__all__ = ["AuditReport", "Check", "find_sequences", "verify_sequence"]


def find_sequences(folder: Path) -> list[Path]:
    """The folder itself if it is a sequence, otherwise every sequence below it.

    Raises:
        SequenceFormatError: there is none.
    """
    if folder.is_dir():
        found = sorted(path.parent for path in folder.rglob("tracks_xyz.npy") if not _hidden(path, folder))
        if found:
            return found
        if (folder / "0").is_dir() or (folder / RECORD_FILE).exists():
            return [folder]
    raise SequenceFormatError(f"'{folder}' holds no sequence: a folder with tracks_xyz.npy is required")


def _hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def verify_sequence(folder: Path, bounds: AuditConfig, scene: DeepScene | None = None, frames: int = 8) -> AuditReport:
    """Runs every check that the files of a sequence allow.

    Args:
        folder: the sequence.
        bounds: what each check allows.
        scene: the meshes it was made from, for rays to be cast at; None for no rays.
        frames: how many frames rays are cast in.

    Raises:
        SequenceFormatError: ``folder`` is no folder.
    """
    if not folder.is_dir():
        raise SequenceFormatError(f"'{folder}' is not a folder; the folder of a sequence is required")
    files, checks = load_files(folder)
    checks += [check_finite(files, bounds), check_images(files), check_cameras(files, bounds)]
    skipped: list[str] = []
    if files.record is None:
        skipped.append(f"sha256: there is no {RECORD_FILE}")
    else:
        checks.append(check_hashes(files))
    if _complete(files):
        checks += _track_checks(files, bounds, skipped)
        table, reason = track_table(files)
        if scene is not None and table:
            checks += verify_deep(files, table, scene, bounds, frames)
        elif scene is not None:
            skipped.append(f"rays at the meshes: {reason}")
    else:
        skipped.append("tracks and visibility: files of the layout are missing or damaged")
    return AuditReport(folder, tuple(checks), tuple(skipped))


def _complete(files: SequenceFiles) -> bool:
    """Whether the checks that read several files find all of them, in matching shapes."""
    needed = ["tracks_xyz.npy", "queries_xytv.npy"]
    parts = ("intrinsics.npy", "extrinsics_w2c.npy", "visibility.npy", "depth.npy", "foreground_mask.npy")
    needed += [f"{view}/{part}" for view in files.views for part in parts]
    if not files.views or any(name not in files.arrays for name in needed):
        return False
    return all(
        files.arrays[f"{view}/depth.npy"].shape == files.arrays[f"{view}/foreground_mask.npy"].shape
        for view in files.views
    )


def _track_checks(files: SequenceFiles, bounds: AuditConfig, skipped: list[str]) -> list[Check]:
    checks = [check_query_pixels(files, bounds), check_query_draw(files), check_moving_share(files, bounds)]
    table, reason = track_table(files)
    if not table:
        skipped.append(f"static tracks, foreground agreement, on surface: {reason}")
        return checks + check_visibility(files, None, bounds)
    checks.append(check_static(files, table["on_actor"]))
    if "surface_xyz.npy" in files.arrays:
        checks.append(check_on_surface(files, table, bounds))
    else:
        skipped.append("on surface: there is no surface_xyz.npy")
    return checks + check_visibility(files, table["on_actor"], bounds)
