"""Rooms from scene files of the user's, read by ``blender_scripts/scene_files/`` in a process of its own."""

import json
import logging
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float64

from perpetua.errors import InputError
from perpetua.machine.blender import BlenderError, Event, run_script
from perpetua.resources import SCRIPT_FOLDER
from perpetua.rooms.config import RoomsConfig
from perpetua.rooms.files.checks import BadSceneFile, check_scene_file, find_scene_files
from perpetua.rooms.script_output import read_room
from perpetua.rooms.source import RoomRejected, RoomWish
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

logger = logging.getLogger(__name__)

SCRIPT = SCRIPT_FOLDER / "scene_files" / "scene_file.py"
# So many times rooms.max_triangles may a file have; the script thins them out to it.
MOST_THINNED = 10
# A floor that fills this share of its bounding rectangle is that rectangle.
RECTANGLE_FRACTION = 0.93
# An outline follows cells drawn this many times finer, and is straightened within half a cell.
OUTLINE_ZOOM = 4


class SceneFileRooms:
    """Scenes that the user brings: .blend, .glb, .gltf or .obj."""

    def draws(self, config: RoomsConfig) -> int | None:
        """As many as there are files: each gives one room.

        Raises:
            InputError: ``rooms.file.path`` names no scene, or a single one that Blender need not open to refuse it.
        """
        files = find_scene_files(config.file.path)
        if len(files) == 1:
            try:
                _check(files[0], config)
            except RoomRejected as rejection:
                raise InputError(str(rejection)) from None
        return len(files)

    def make(self, wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """The room of one file, which the seed picks; the wish is left aside, for the file is what it is.

        Raises:
            InputError: ``rooms.file.path`` names no scene.
            RoomRejected: the file cannot become a room.
        """
        files = find_scene_files(config.file.path)
        path = files[int(seed.stream("scene_file").permutation(len(files))[attempt % len(files)])]
        _check(path, config)
        try:
            return self._read(path.resolve(), config, scratch)
        except BadSceneFile as bad:
            raise _rejected(path, bad) from None

    def _read(self, path: Path, config: RoomsConfig, scratch: Path) -> Room:
        folder = scratch.resolve() / "scene_file"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        settings = config.file
        job = {
            "path": str(path),
            "suffix": path.suffix.lower().removeprefix("."),
            "root": str(path.parent),
            "kind": settings.kind,
            "metres_per_unit": settings.metres_per_unit,
            "up_axis": settings.up_axis,
            "floor_z_m": settings.floor_z_m,
            "max_triangles": config.max_triangles,
            "folder": str(folder),
        }
        (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
        try:
            _run_script(folder, config.timeout_s)
            (folder / "room.blend").replace(scratch / "room.blend")
            room = read_room(folder, f"file_{path.stem}", scratch / "room.blend")
            cells = json.loads((folder / "room.json").read_text(encoding="utf-8"))["floor_cells"]
        finally:
            shutil.rmtree(folder)
        outline_m = trace_floor(cells)
        return room if outline_m is None else replace(room, floor_polygon_m=outline_m)


def _check(path: Path, config: RoomsConfig) -> None:
    try:
        check_scene_file(path, config.file.max_file_mb, MOST_THINNED * config.max_triangles)
    except BadSceneFile as bad:
        raise _rejected(path, bad) from None


def _rejected(path: Path, bad: BadSceneFile) -> RoomRejected:
    return RoomRejected(bad.rule, f"scene file '{path}': {bad}")


def _run_script(folder: Path, timeout_s: float) -> None:
    refusals: list[Event] = []

    def listen(event: Event) -> None:
        if event["event"] == "refused":
            refusals.append(event)
        elif event["event"] == "note":
            logger.warning("%s", event["text"])

    job_path = folder / "job.json"
    try:
        run_script(SCRIPT, job_path, blender=None, scratch=folder, silence_timeout_s=timeout_s, on_event=listen)
    except BlenderError as error:
        if error.silent:
            raise BadSceneFile(
                "timeout", f"reading it took longer than rooms.timeout_s = {timeout_s:.0f} s: raise it or simplify it"
            ) from None
        raise BadSceneFile("format", f"Blender fails on it, it may be damaged: {error}") from None
    if refusals:
        raise BadSceneFile(str(refusals[0]["rule"]), str(refusals[0]["message"]))


def trace_floor(cells: dict[str, Any]) -> Float64[np.ndarray, "K 2"] | None:
    """The outline, counter-clockwise, of a floor drawn in cells; None where it is a rectangle, near enough.

    Args:
        cells: ``rows`` ("#" where there is floor; row i lies at x = ``corner_m[0] + cell_m * i``), ``cell_m`` and
            ``corner_m``, as the script writes them.
    """
    import cv2

    mask = np.array([[mark == "#" for mark in row] for row in cells["rows"]], bool)
    if mask.mean() >= RECTANGLE_FRACTION:
        return None
    fine = np.kron(_without_gaps(mask), np.ones((OUTLINE_ZOOM, OUTLINE_ZOOM), bool))
    outlines, _ = cv2.findContours(fine.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    longest = max(outlines, key=cv2.contourArea)
    corners = cv2.approxPolyDP(longest, 0.5 * OUTLINE_ZOOM, closed=True)[:, 0, ::-1].astype(np.float64)
    corners_m = np.array(cells["corner_m"]) + cells["cell_m"] * (corners + 0.5) / OUTLINE_ZOOM
    x_m, y_m = corners_m.T
    turns_left = (x_m * np.roll(y_m, -1) - y_m * np.roll(x_m, -1)).sum() > 0
    return corners_m if turns_left else np.ascontiguousarray(corners_m[::-1])


def _without_gaps(mask: Bool[np.ndarray, "X Y"]) -> Bool[np.ndarray, "X Y"]:
    """Closes gaps of one cell, as between tiles or where a pillar stands."""
    from scipy import ndimage

    padded = np.pad(mask, 2)
    closed = ndimage.binary_closing(padded, np.ones((3, 3), bool))[2:-2, 2:-2]
    return np.asarray(closed | mask)
