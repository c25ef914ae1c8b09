"""What the suites of perpetua.testing need to know."""

from perpetua.testing.samples import RoomSample

ROOM_SAMPLES = {"hall": RoomSample(kinds=("livingroom",), made_kind="hall")}
