"""Rooms by Infinigen Indoors 2, made by ``blender_scripts/infinigen/infinigen_room.py`` in a process of its own."""

import importlib.util
import json
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from perpetua.geometry.mesh import TriMesh
from perpetua.io.files import write_json
from perpetua.machine.blender import BlenderError, Event, run_script
from perpetua.machine.extras import missing_extra
from perpetua.resources import SCRIPT_FOLDER
from perpetua.rooms.collider_gap import ColliderGap, collider_gap
from perpetua.rooms.config import RoomKind, RoomsConfig
from perpetua.rooms.script_output import read_room
from perpetua.rooms.source import RoomRejected, RoomWish
from perpetua.scene.room import Room
from perpetua.seeding import StageSeed

SCRIPT = SCRIPT_FOLDER / "infinigen" / "infinigen_room.py"
# How far Infinigen's colliders are from what is rendered, beside the room.
COLLIDER_GAP_FILE = "collider_gap.json"
# Infinigen furnishes a bathroom with few objects: at full size most of it would be empty floor.
SIDE_SCALE: dict[RoomKind, float] = {"bathroom": 0.8}


class InfinigenRooms:
    """Furnished rooms by Infinigen Indoors 2 (https://infinigen.org).

    Infinigen's own colliders are its meshes before subdivision, without skirting boards and ceiling details. Navigation
    and distance fields here use the meshes as rendered instead, which is stricter: nothing in the picture is missing
    from them. How far the two are apart is measured for each room (``collider_gap``).
    """

    def draws(self, config: RoomsConfig) -> int | None:
        """Without end.

        Raises:
            EnvironmentSetupError: Infinigen 2 is not installed.
        """
        if importlib.util.find_spec("infinigen2") is None:
            raise missing_extra("rooms.source=infinigen", "infinigen", "infinigen", "choose rooms.source=procedural")
        return None

    def make(self, wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, scratch: Path) -> Room:
        """A room as wished, with its ``room.blend`` in ``scratch``.

        Raises:
            RoomRejected: the generator crashed, took longer than ``rooms.timeout_s`` or more than
                ``rooms.max_memory_mb``.
        """
        folder = scratch.resolve() / "infinigen"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        job = room_job(wish, config, seed, attempt, folder)
        (folder / "job.json").write_text(json.dumps(job), encoding="utf-8")
        _run_script(folder, config)
        (folder / "room.blend").replace(scratch / "room.blend")
        room = read_room(folder, f"infinigen_{wish.kind}", scratch / "room.blend")
        write_json(scratch / COLLIDER_GAP_FILE, asdict(_collider_gap(folder, room)))
        shutil.rmtree(folder)
        return room


def room_job(wish: RoomWish, config: RoomsConfig, seed: StageSeed, attempt: int, folder: Path) -> dict[str, Any]:
    """What the script is told; its files go to ``folder``."""
    return {
        "kind": wish.kind,
        "seed": int(seed.stream("infinigen", attempt).integers(2**31)),
        "dimensions_m": dimensions_m(wish),
        "daytime": wish.daytime,
        "lamps_on": wish.lamps_on,
        "max_memory_mb": config.max_memory_mb,
        "folder": str(folder),
    }


def dimensions_m(wish: RoomWish) -> list[float]:
    """Sides along x and y and height that Infinigen is asked for, metres, to the centimetre."""
    x_m, y_m, height_m = wish.size_m
    scale = SIDE_SCALE.get(wish.kind, 1.0)
    return [round(scale * x_m, 2), round(scale * y_m, 2), height_m]


def _run_script(folder: Path, config: RoomsConfig) -> None:
    refusals: list[Event] = []

    def on_event(event: Event) -> None:
        if event["event"] == "refused":
            refusals.append(event)

    timeout_s = config.timeout_s
    job_path = folder / "job.json"
    try:
        run_script(SCRIPT, job_path, blender=None, scratch=folder, silence_timeout_s=timeout_s, on_event=on_event)
    except BlenderError as error:
        if refusals:
            raise RoomRejected(refusals[0]["rule"], refusals[0]["reason"]) from None
        if error.silent:
            raise RoomRejected("timeout", f"Infinigen took longer than rooms.timeout_s = {timeout_s:.0f} s") from None
        raise RoomRejected("crash", f"Infinigen failed: {error}") from None


def _collider_gap(folder: Path, room: Room) -> ColliderGap:
    with np.load(folder / "meshes.npz", allow_pickle=False) as arrays:
        colliders = TriMesh(arrays["collider_vertices_m"], arrays["collider_faces"])
    return collider_gap(room, colliders)
