"""What installed packages add to Perpetua, for the commands that list it."""

from typing import Any

from perpetua.actors.bodies.source import BODY_MODELS
from perpetua.formats.source import EXPORTERS
from perpetua.motion.source import MOTION_SOURCES
from perpetua.registry import PlugIn, Registry
from perpetua.rooms.source import ROOM_SOURCES

# Their entries are chosen by a setting, which is the registry's kind.
SETTINGS: tuple[Registry[Any], ...] = (ROOM_SOURCES, BODY_MODELS, MOTION_SOURCES)
REGISTRIES: tuple[Registry[Any], ...] = (*SETTINGS, EXPORTERS)


def installed_plug_ins() -> list[PlugIn]:
    """Everything that installed packages offer, with what is wrong with it."""
    return [plug_in for registry in REGISTRIES for plug_in in registry.plug_ins()]


def setting_notes() -> dict[str, str]:
    """For each setting that names a plug-in, as ``a.b``: which names packages add, and which package each is of."""
    notes: dict[str, str] = {}
    for registry in SETTINGS:
        added = [f"{name} (of {registry.origin(name)})" for name in registry if registry.package(name) is not None]
        if added:
            notes[registry.kind] = f"installed beside perpetua: {', '.join(added)}"
    return notes
