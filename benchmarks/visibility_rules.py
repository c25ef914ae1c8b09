"""Rendered depth and object index, and rules that decide from them whether a point is seen, against exact rays.

    perpetua generate --preset quick --seed 7 --rooms 2 --out made
    python benchmarks/visibility_rules.py made/*/* --frames 8 --sheet rules.png

Truth: the point projects onto the image, and the ray from the camera meets nothing before it (Embree through trimesh,
depths in double precision; ``perpetua.audit.deep``, which shares no code with what made the visibility). The rules:

- stored: the sequence's own ``visibility.npy``.
- Kubric: of the four pixel centres around the projection, the largest ray length is at least 0.99 times the point's,
  and one shows the point's object (``challenges/point_tracking/dataset.py`` of google-research/kubric; its test of
  normals, which it makes only where it trusts them, is left out).
- PointOdyssey: of the 2x2 depths around the projection, the largest is at least 0.97 times the point's, the smallest at
  most 1.05 times, and the point is within 5% of their median (``utils/gen_tracking_indoor.py`` of
  y-zheng18/point_odyssey); it does not look at objects.

Points that a ray reaches and that no pixel around shows the object of (in no pixel) are hidden by the rule that a point
is visible only where the image agrees; they get fewer as images get larger.

Depth is compared at pixel centres off silhouettes, where the eight neighbours show the same object and depth does not
bend, object index there and everywhere. The work area of the sequences must still be there. The sheet shows examples of
what each rule still gets wrong.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float64, Int64
from pixel_agreement import count_pixels
from visibility_ledger import COUNTED, Ledger, print_rules, print_sequences
from visibility_sheet import Example, write_sheet

from perpetua.audit.deep import Reach, SceneRays
from perpetua.audit.files import SequenceFiles, load_files
from perpetua.audit.geometry import camera_centre_m, project_to_pixels
from perpetua.audit.verify import find_sequences
from perpetua.errors import InputError
from perpetua.pipeline.work_area import load_scene
from perpetua.scene.scene import Scene
from perpetua.tracks.ray_caster import HairFaces, hair_faces

CORNERS = np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
# What Blender writes where there is no surface.
BACKGROUND_M = 1e10
COINCIDENT_M = 0.01
GRAZING_COSINE = float(np.cos(np.radians(80.0)))


@dataclass(frozen=True)
class Shot:
    """Points that project onto one image, and the four pixel centres around each (repeated at the image's edge)."""

    object_index: Int64[np.ndarray, " N"]
    depth_m: Float64[np.ndarray, " N"]
    length_m: Float64[np.ndarray, " N"]
    stored: Bool[np.ndarray, " N"]
    around_object: Int64[np.ndarray, "N 4"]
    around_depth_m: Float64[np.ndarray, "N 4"]
    around_length_m: Float64[np.ndarray, "N 4"]


def kubric_rule(shot: Shot) -> Bool[np.ndarray, " N"]:
    """Largest of four ray lengths, and any of four objects."""
    not_hidden = shot.around_length_m.max(axis=1) >= 0.99 * shot.length_m
    return np.asarray(not_hidden & (shot.around_object == shot.object_index[:, None]).any(axis=1))


def point_odyssey_rule(shot: Shot) -> Bool[np.ndarray, " N"]:
    """Bands around the largest, the smallest and the median of four depths."""
    around_m, point_m = shot.around_depth_m, shot.depth_m
    median_m = np.median(around_m, axis=1)
    seen = (around_m.max(axis=1) >= 0.97 * point_m) & (around_m.min(axis=1) <= 1.05 * point_m)
    return np.asarray(seen & (point_m > 0.95 * median_m) & (point_m < 1.05 * median_m))


RULES: dict[str, Callable[[Shot], Bool[np.ndarray, " N"]]] = {
    "stored": lambda shot: shot.stored,
    "Kubric": kubric_rule,
    "PointOdyssey": point_odyssey_rule,
}


@dataclass(frozen=True)
class Subject:
    """A sequence, its meshes, and what its record says of its tracks."""

    files: SequenceFiles
    scene: Scene
    object_index: Int64[np.ndarray, " P"]
    face: Int64[np.ndarray, " P"]
    moving: Bool[np.ndarray, " P"]
    hair: HairFaces

    @classmethod
    def load(cls, folder: Path) -> "Subject":
        """Reads a sequence and its kept work.

        Raises:
            InputError: the sequence is incomplete, or its work area is gone.
        """
        files, checks = load_files(folder)
        wrong = [check.detail for check in checks if not check.passed]
        if wrong or files.record is None or "surface_xyz.npy" not in files.arrays:
            raise InputError(f"'{folder}' must be a complete sequence with sequence.json: {'; '.join(wrong)}")
        table, scene = files.record["tracks"], load_scene(folder).scene
        moving = np.array(table["class"]) != "static"
        numbers = [np.array(table[name], np.int64) for name in ("object_index", "face")]
        return cls(files, scene, numbers[0], numbers[1], moving, hair_faces(scene.actors))


def score(subject: Subject, frames: int, ledger: Ledger) -> None:
    """Asks every rule about every track in every view, at so many frames."""
    rays = SceneRays(subject.scene)
    total = len(subject.files.arrays["tracks_xyz.npy"])
    for frame in np.unique(np.linspace(0, total - 1, min(frames, total)).round().astype(int)).tolist():
        for view in range(len(subject.files.views)):
            assert subject.scene.object_index is not None
            ledger.pixels += count_pixels(subject.files, rays, subject.scene.object_index, view, frame)
            _score_image(subject, rays, view, frame, ledger)


def _score_image(subject: Subject, rays: SceneRays, view: int, frame: int, ledger: Ledger) -> None:
    files = subject.files
    pose = files.of_view(view, "extrinsics_w2c.npy")[frame]
    point_m = np.asarray(files.arrays["tracks_xyz.npy"][frame], np.float64)
    seen = project_to_pixels(files.of_view(view, "intrinsics.npy"), pose, point_m)
    height, width = files.of_view(view, "depth.npy").shape[1:]
    with np.errstate(invalid="ignore"):
        inside = (seen[:, :2] >= -0.5) & (seen[:, :2] < [width - 0.5, height - 0.5])
        on_image = (seen[:, 2] > 0) & inside.all(axis=1)
    tracks = np.flatnonzero(on_image)
    eye_m = camera_centre_m(pose)
    ends = rays.reach(frame, eye_m, point_m[tracks], subject.object_index[tracks], subject.face[tracks])
    true = np.zeros(len(point_m), bool)
    true[tracks] = ends.reached
    shot = _shot(subject, view, frame, tracks, seen[tracks])
    shown = np.zeros(len(point_m), bool)
    shown[tracks] = (shot.around_object == shot.object_index[:, None]).any(axis=1)
    for rule, decide in RULES.items():
        # Only what is stored speaks of points off the image, and must call them hidden.
        found = np.asarray(files.of_view(view, "visibility.npy")[frame]) & (rule == "stored")
        found[tracks] = decide(shot)
        _enter(ledger, rule, subject.moving, on_image, found, true, shown)
        wrong = np.flatnonzero(found[tracks] != ends.reached)
        for place, kind in zip(wrong.tolist(), _kinds(subject, frame, eye_m, tracks, ends, shot, wrong), strict=True):
            pixel_px = tuple(seen[tracks[place], :2].tolist())
            ledger.show(rule, kind, Example(files.folder, view, frame, int(tracks[place]), pixel_px))


def _enter(
    ledger: Ledger,
    rule: str,
    moving: Bool[np.ndarray, " P"],
    on_image: Bool[np.ndarray, " P"],
    found: Bool[np.ndarray, " P"],
    true: Bool[np.ndarray, " P"],
    shown: Bool[np.ndarray, " P"],
) -> None:
    """Counts what a rule found in one image."""
    for group, members in {"all": np.ones(len(moving), bool), "static": ~moving, "moving": moving}.items():
        of_group = {
            "entries": members,
            "on image": members & on_image,
            "wrongly visible": members & found & ~true,
            "wrongly hidden": members & ~found & true,
            "of these in no pixel": members & ~found & true & ~shown,
        }
        ledger.enter(rule, group, {name: int(of_group[name].sum()) for name in COUNTED})


def _shot(
    subject: Subject, view: int, frame: int, tracks: Int64[np.ndarray, " N"], seen: Float64[np.ndarray, "N 3"]
) -> Shot:
    assert subject.scene.object_index is not None
    depth_m = np.asarray(subject.files.of_view(view, "depth.npy")[frame], np.float64)
    fx, fy, cx, cy = np.asarray(subject.files.of_view(view, "intrinsics.npy"), np.float64)
    corner = np.floor(seen[:, :2]).astype(np.int64)[:, None] + CORNERS
    column, row = corner[..., 0].clip(0, depth_m.shape[1] - 1), corner[..., 1].clip(0, depth_m.shape[0] - 1)
    around_m = np.where(depth_m[row, column] > 0, depth_m[row, column], BACKGROUND_M)
    shown = np.asarray(subject.scene.object_index[view][frame])[row, column].astype(np.int64)

    def stretch(x: Float64[np.ndarray, "*any"], y: Float64[np.ndarray, "*any"]) -> Float64[np.ndarray, "*any"]:
        return np.sqrt(1.0 + ((x - cx) / fx) ** 2 + ((y - cy) / fy) ** 2)

    return Shot(
        object_index=subject.object_index[tracks],
        depth_m=seen[:, 2],
        length_m=seen[:, 2] * stretch(seen[:, 0], seen[:, 1]),
        stored=np.asarray(subject.files.of_view(view, "visibility.npy")[frame])[tracks],
        around_object=shown,
        around_depth_m=around_m,
        around_length_m=around_m * stretch(column.astype(np.float64), row.astype(np.float64)),
    )


def _kinds(
    subject: Subject,
    frame: int,
    eye_m: Float64[np.ndarray, "3"],
    tracks: Int64[np.ndarray, " N"],
    ends: Reach,
    shot: Shot,
    wrong: Int64[np.ndarray, " M"],
) -> list[str]:
    """What is special about each disagreement: the first reason that applies."""
    own, theirs = shot.object_index[wrong], ends.object_index[wrong]
    own_hair = subject.hair.has(own.astype(np.int32), subject.face[tracks[wrong]].astype(np.int32))
    their_hair = subject.hair.has(theirs.astype(np.int32), ends.face[wrong].astype(np.int32))
    corner_m = np.asarray(subject.files.arrays["surface_xyz.npy"][frame], np.float64)[tracks[wrong]]
    normal = np.cross(corner_m[:, 1] - corner_m[:, 0], corner_m[:, 2] - corner_m[:, 0])
    towards_m = eye_m - np.asarray(subject.files.arrays["tracks_xyz.npy"][frame], np.float64)[tracks[wrong]]
    size = np.linalg.norm(normal, axis=1) * np.linalg.norm(towards_m, axis=1)
    facing = (normal * towards_m).sum(axis=1)
    grazing = np.abs(facing) < GRAZING_COSINE * size
    shown = [(shot.around_object[wrong] == index[:, None]).any(axis=1) for index in (own, theirs)]
    # Sleeves and hems open to the back of what the stored rule calls closed. What is left lies on rims and edges of
    # which no pixel's centre shows the point's own side.
    of_hidden = {
        "hair": own_hair,
        "grazing": grazing,
        "no pixel around shows its object": ~shown[0],
        "its back is turned to the camera": facing < 0.0,
    }
    of_visible = {
        "hair": own_hair | their_hair,
        "covered from less than 1 cm": ends.short_m[wrong] < COINCIDENT_M,
        "grazing": grazing,
        "blocker in no pixel around": ~shown[1],
    }
    names = []
    for place, reached in enumerate(ends.reached[wrong].tolist()):
        side, reasons = ("wrongly hidden", of_hidden) if reached else ("wrongly visible", of_visible)
        names.append(f"{side}: {next((name for name, holds in reasons.items() if holds[place]), 'other edges')}")
    return names


def main() -> None:
    """Prints the tables, and draws the sheet."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="sequences whose work area is kept")
    parser.add_argument("--frames", type=int, default=24, help="frames of each, at even distances")
    parser.add_argument("--examples", type=int, default=5, help="pictures of each kind of disagreement")
    parser.add_argument("--sheet", type=Path, help="PNG of examples")
    arguments = parser.parse_args()
    ledgers: dict[str, Ledger] = {}
    ledger = Ledger(list(RULES), arguments.examples)
    for folder in (folder for given in arguments.folders for folder in find_sequences(given)):
        subject = Subject.load(folder)
        kind = str((subject.files.record or {}).get("room_kind"))
        own = ledgers.setdefault(f"{folder.name} ({kind})", Ledger(list(RULES), arguments.examples))
        score(subject, arguments.frames, own)
        ledger.add(own)
    print_sequences({**ledgers, "all": ledger})
    print_rules(ledger)
    if arguments.sheet is not None:
        rows = {f"{r} ({ledger.kinds[r, kind]})\n{kind}": ledger.examples[r, kind] for r, kind in ledger.in_order()}
        write_sheet(rows, arguments.sheet)
        print(f"\nwrote {arguments.sheet}")


if __name__ == "__main__":
    main()
