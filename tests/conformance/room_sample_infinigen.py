"""One small Infinigen room: each takes a minute in a Blender process of its own."""

import pytest

from tests.support.room_sample import RoomSample

SAMPLE = RoomSample(
    kinds=("bathroom",), marks=(pytest.mark.slow, pytest.mark.blender, pytest.mark.infinigen), many_draws=False
)
