"""Checks of queries, of how tracks move, and of how they lie on their surfaces."""

from typing import Any

import numpy as np
from jaxtyping import Bool

from perpetua.audit.config import AuditConfig
from perpetua.audit.files import RECORD_FILE, SequenceFiles
from perpetua.audit.geometry import moves_more_than, project_to_pixels
from perpetua.audit.report import Check

QUERY_SEED = 42


def check_query_pixels(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """Each query is the projection of its track at a frame and view where the track is marked visible."""
    queries, tracks = files.arrays["queries_xytv.npy"], files.arrays["tracks_xyz.npy"]
    faults: list[str] = []
    worst = 0.0
    for index, (x, y, frame, view) in enumerate(np.asarray(queries, np.float64)):
        rule = f"queries_xytv.npy[{index}]"
        if not (frame in range(len(tracks)) and view in range(len(files.views))):
            faults.append(f"{rule} asks for frame {frame:g} of view {view:g}, which does not exist")
            continue
        t, v = int(frame), int(view)
        camera = files.of_view(v, "intrinsics.npy"), files.of_view(v, "extrinsics_w2c.npy")[t]
        seen = project_to_pixels(*camera, tracks[t, index : index + 1])[0]
        error = float(np.hypot(seen[0] - x, seen[1] - y)) if seen[2] > 0 else np.inf
        worst = max(worst, error) if np.isfinite(error) else np.inf
        if not error <= bounds.reprojection_px:
            faults.append(f"{rule} is ({x:.3f}, {y:.3f}), and its track is at ({seen[0]:.3f}, {seen[1]:.3f})")
        elif not files.of_view(v, "visibility.npy")[t, index]:
            faults.append(f"{rule} is not visible in {v}/visibility.npy[{t}, {index}]")
    bound = f"<= {bounds.reprojection_px:g} px, and visible there"
    return Check("query pixels", not faults, worst, bound, _examples(faults))


def check_query_draw(files: SequenceFiles) -> Check:
    """Frame and view of each query are the draw of ``numpy.random.default_rng(42)`` from its visible pairs.

    The pairs are listed view by view, then frame by frame; tracks draw ``integers(pairs)`` in their order.
    """
    queries = files.arrays["queries_xytv.npy"]
    stacked = np.stack([files.of_view(view, "visibility.npy") for view in range(len(files.views))])
    rng = np.random.default_rng(QUERY_SEED)
    faults: list[str] = []
    for index in range(len(queries)):
        views, frames = np.nonzero(stacked[:, :, index])
        if len(views) == 0:
            faults.append(f"track {index} is visible nowhere, and must not be in the data")
            continue
        pick = int(rng.integers(len(views)))
        wanted, given = (int(frames[pick]), int(views[pick])), (float(queries[index, 2]), float(queries[index, 3]))
        if wanted != given:
            faults.append(f"queries_xytv.npy[{index}] asks for frame, view {given}, and the draw gives {wanted}")
    bound = f"as drawn with seed {QUERY_SEED}"
    return Check("query draw", not faults, float(len(faults)), bound, _examples(faults))


def check_moving_fraction(files: SequenceFiles, bounds: AuditConfig) -> Check:
    """The share of tracks with two positions more than ``moving_m`` apart is about the one that was asked for."""
    fraction = float(moves_more_than(files.arrays["tracks_xyz.npy"], bounds.moving_m).mean())
    wanted = _recorded_moving_fraction(files, bounds.moving_share)
    passed = abs(fraction - wanted) <= bounds.moving_share_slack
    bound = f"{wanted:g} within {bounds.moving_share_slack:g}"
    detail = "" if passed else f"tracks_xyz.npy: {fraction:.1%} of tracks move more than {bounds.moving_m:g} m"
    return Check("moving tracks", passed, fraction, bound, detail)


def _recorded_moving_fraction(files: SequenceFiles, otherwise: float) -> float:
    try:
        return float((files.record or {})["config"]["tracks"]["dynamic_share"])
    except (KeyError, TypeError, ValueError):
        return otherwise


def track_table(files: SequenceFiles) -> tuple[dict[str, np.ndarray], str]:
    """Per track ``object_index``, ``face``, ``barycentric`` and ``on_actor`` of the record, or why there is none."""
    if files.record is None:
        return {}, f"there is no {RECORD_FILE}"
    table: Any = files.record.get("tracks")
    count = files.lengths.get("P", -1)
    try:
        found: dict[str, np.ndarray] = {
            "object_index": np.asarray(table["object_index"], np.int64),
            "face": np.asarray(table["face"], np.int64),
            "barycentric": np.asarray(table["barycentric"], np.float64),
        }
        actors = [obj["object_index"] for obj in files.record["objects"] if "actor" in obj]
    except (KeyError, TypeError, ValueError) as error:
        return {}, f"{RECORD_FILE} has no sound table of tracks and objects: {error!r}"
    shapes = {"object_index": (count,), "face": (count,), "barycentric": (count, 3)}
    if any(found[name].shape != shape for name, shape in shapes.items()):
        return {}, f"{RECORD_FILE} must have one entry for each of {count} tracks"
    found["on_actor"] = np.isin(found["object_index"], actors)
    return found, ""


def check_static(files: SequenceFiles, on_actor: Bool[np.ndarray, " P"]) -> Check:
    """Tracks that are not on actors have one position, to the last bit."""
    tracks = files.arrays["tracks_xyz.npy"][:, ~on_actor]
    moved = np.abs(tracks - tracks[:1]).max(axis=(0, 2)) if tracks.size else np.zeros(1)
    worst = int(moved.argmax())
    detail = ""
    if moved[worst] != 0.0:
        detail = f"tracks_xyz.npy[:, {np.flatnonzero(~on_actor)[worst]}] is not on an actor, and moves {moved[worst]} m"
    return Check("static tracks", not detail, float(moved[worst]), "exactly 0 m", detail)


def check_on_surface(files: SequenceFiles, table: dict[str, np.ndarray], bounds: AuditConfig) -> Check:
    """Each track is the recorded barycentric point of its stored triangle."""
    tracks, surface = files.arrays["tracks_xyz.npy"], files.arrays["surface_xyz.npy"]
    weight = table["barycentric"]
    error_m = np.empty(tracks.shape[:2])
    for frame in range(len(tracks)):
        on_face = (weight[:, :, None] * surface[frame].astype(np.float64)).sum(axis=1)
        error_m[frame] = np.linalg.norm(on_face - tracks[frame], axis=1)
    frame, track = (
        int(index) for index in np.unravel_index(int(np.nan_to_num(error_m, nan=np.inf).argmax()), error_m.shape)
    )
    worst = float(error_m[frame, track])
    passed = bool(worst <= bounds.surface_error_m and (np.abs(weight.sum(axis=1) - 1.0) < 1e-6).all())
    detail = "" if passed else f"tracks_xyz.npy[{frame}, {track}] is {worst:.3g} m from its triangle in surface_xyz.npy"
    return Check("on surface", passed, worst, f"<= {bounds.surface_error_m:g} m", detail)


def _examples(faults: list[str]) -> str:
    more = f"; and {len(faults) - 3} more" if len(faults) > 3 else ""
    return "; ".join(faults[:3]) + more
