"""Checks a sequence on disk with code of its own: nothing here is shared with what made the data, the reader of
pickled JPEG arrays aside. It also takes data from elsewhere, as far as its files allow."""

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from perpetua.audit.array_checks import check_cameras, check_finite, check_hashes, check_images
from perpetua.audit.config import AuditConfig
from perpetua.audit.cross_checks import check_index_of_tracks, check_labels_of_tracks, check_views_agree
from perpetua.audit.deep import verify_deep
from perpetua.audit.files import PICTURE_FILES, RECORD_FILE, SEQUENCE_FILES, SequenceFiles, load_files
from perpetua.audit.flow_checks import check_flow, check_scene_flow, check_view_flow
from perpetua.audit.label_checks import check_normals, check_object_index
from perpetua.audit.picture_checks import check_pictures
from perpetua.audit.pose_checks import check_poses, check_track_pixels
from perpetua.audit.report import AuditReport, Check
from perpetua.audit.track_checks import (
    check_moving_fraction,
    check_on_surface,
    check_query_draw,
    check_query_pixels,
    check_static,
    track_table,
)
from perpetua.audit.visibility_checks import check_visibility
from perpetua.errors import SequenceFormatError
from perpetua.scene.scene import Scene

CAMERA_FILES = ("intrinsics.npy", "extrinsics_w2c.npy", "visibility.npy")

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
    if not folder.exists():
        raise SequenceFormatError(f"'{folder}' does not exist: give a sequence folder, or a folder that holds some")
    raise SequenceFormatError(f"'{folder}' holds no sequence: a folder with tracks_xyz.npy is required")


def _hidden(path: Path, folder: Path) -> bool:
    return any(part.startswith(".") for part in path.relative_to(folder).parts)


def verify_sequence(folder: Path, bounds: AuditConfig, scene: Scene | None = None, frames: int = 8) -> AuditReport:
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
    # Damaged data may hold anything; what comes of it has no place in bounds.
    with np.errstate(all="ignore"):
        return _verify(folder, bounds, scene, frames)


def _verify(folder: Path, bounds: AuditConfig, scene: Scene | None, frames: int) -> AuditReport:
    files, checks = load_files(folder)
    images = check_images(files)
    checks += [check_finite(files, bounds), images, check_cameras(files, bounds)]
    skipped: list[str] = []
    if files.record is None:
        skipped.append(f"sha256: there is no {RECORD_FILE}")
    else:
        checks.append(check_hashes(files))
    if not _has(files, SEQUENCE_FILES, CAMERA_FILES):
        skipped.append("tracks and visibility: files of the layout are missing or damaged")
        return AuditReport(folder, tuple(checks), tuple(skipped))
    table, reason = track_table(files)
    checks += _track_checks(files, table, bounds)
    checks += _surface_checks(files, table, bounds, skipped, reason)
    if set(files.jpegs) == set(files.views) and images.passed:
        checks.append(check_pictures(files))
    if _has(files, (), PICTURE_FILES):
        checks += [check_views_agree(files, bounds)] if len(files.views) > 1 else []
        checks += _label_checks(files, table, bounds)
        if scene is not None and table:
            checks += verify_deep(files, table, scene, bounds, frames)
        elif scene is not None:
            skipped.append(f"rays at the meshes: {reason}")
    else:
        skipped.append(f"depth agreement, views agree, labels: not every view has {' and '.join(PICTURE_FILES)}")
    return AuditReport(folder, tuple(checks), tuple(skipped))


def _has(files: SequenceFiles, names: Iterable[str], of_views: Iterable[str]) -> bool:
    return bool(files.views) and all(name in files.arrays for name in names) and files.every_view_has(*of_views)


def _track_checks(files: SequenceFiles, table: dict[str, np.ndarray], bounds: AuditConfig) -> list[Check]:
    """What tracks, cameras and visibility say of each other."""
    checks = [check_query_pixels(files, bounds), check_query_draw(files)]
    if files.every_view_has("tracks_xy.npy"):
        checks.append(check_track_pixels(files, bounds))
    if table and {"object_poses.npy", "object_boxes.npy"} <= set(files.arrays):
        checks.append(check_poses(files, table["on_actor"], bounds))
    return checks


def _surface_checks(
    files: SequenceFiles, table: dict[str, np.ndarray], bounds: AuditConfig, skipped: list[str], reason: str
) -> list[Check]:
    """How tracks move, how they lie on surfaces, and whether images show them."""
    checks = []
    if files.record is None:
        skipped.append(f"moving tracks: there is no {RECORD_FILE} to say how many should")
    else:
        checks.append(check_moving_fraction(files, bounds))
    if not table:
        skipped.append(f"static tracks, foreground agreement, on surface: {reason}")
    else:
        checks.append(check_static(files, table["on_actor"]))
        if "surface_xyz.npy" in files.arrays:
            checks.append(check_on_surface(files, table, bounds))
        else:
            skipped.append("on surface: there is no surface_xyz.npy")
    if files.every_view_has(*PICTURE_FILES):
        checks += check_visibility(files, table["on_actor"] if table else None, bounds)
    return checks


def _label_checks(files: SequenceFiles, table: dict[str, np.ndarray], bounds: AuditConfig) -> list[Check]:
    """Labels of every pixel, as far as there are any."""
    checks = []
    if files.every_view_has("object_index.npy"):
        checks.append(check_object_index(files))
        if table:
            checks.append(check_index_of_tracks(files, table["object_index"]))
    if files.every_view_has("normals.npy"):
        checks.append(check_normals(files))
    if files.every_view_has("flow.npy", "flow_state.npy"):
        checks += check_flow(files, bounds)
    if any(name.partition("/")[2].startswith("flow_to_") for name in files.arrays):
        checks += check_view_flow(files, bounds)
    if files.every_view_has("scene_flow.npy"):
        checks.append(check_scene_flow(files, bounds))
    return checks + check_labels_of_tracks(files)
