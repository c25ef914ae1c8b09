"""The only source of randomness: named, independent streams.

A stream depends on its names alone, never on what was drawn before it, so room k of seed s is the same whether
it is made first, last or alone.
"""

import hashlib
import json
from dataclasses import dataclass

import numpy as np


def stream(seed: int, room: int, stage: str, *names: str | int) -> np.random.Generator:
    """An independent random stream for one purpose.

    Args:
        seed: the data set's seed (``--seed``), >= 0.
        room: index of the room within the data set, >= 0.
        stage: name of the stage that draws.
        names: what is drawn, for example ``("candidate", 3)``.

    Returns:
        A PCG64 generator seeded with the SHA-256 of the names (``numpy.random.SeedSequence`` spreads the bits).
    """
    text = json.dumps([int(seed), int(room), stage, *names], separators=(",", ":"))
    digest = hashlib.sha256(text.encode()).digest()
    words = np.frombuffer(digest, dtype="<u4")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([int(word) for word in words])))


@dataclass(frozen=True)
class StageSeed:
    """What one stage of one room draws from; ``perpetua.pipeline`` makes one per stage and room.

    ``redraw`` counts the draws that were rejected before this one.
    """

    seed: int
    room: int
    stage: str
    redraw: int = 0

    def stream(self, *names: str | int) -> np.random.Generator:
        """The independent stream of this stage with these names."""
        return stream(self.seed, self.room, self.stage, *names, *(("redraw", self.redraw) if self.redraw else ()))
