"""Which rules furnish which kind of room."""

from collections.abc import Callable

from perpetua.rooms.config import RoomKind
from perpetua.rooms.procedural.layout.common_rules import decorate
from perpetua.rooms.procedural.layout.living_rules import furnish_bedroom, furnish_diningroom, furnish_livingroom
from perpetua.rooms.procedural.layout.rules import Layout
from perpetua.rooms.procedural.layout.wet_rules import furnish_bathroom, furnish_kitchen

# Each rule returns whether the room got what it is recognised by.
RULES: dict[RoomKind, Callable[[Layout], bool]] = {
    "bathroom": furnish_bathroom,
    "bedroom": furnish_bedroom,
    "diningroom": furnish_diningroom,
    "kitchen": furnish_kitchen,
    "livingroom": furnish_livingroom,
}


def furnish(layout: Layout, kind: RoomKind) -> bool:
    """Places the furniture of a room of this kind; False if what the kind needs did not fit."""
    if not RULES[kind](layout):
        return False
    for surface in list(layout.pieces):
        decorate(layout, surface)
    return True
