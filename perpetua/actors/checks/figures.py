"""What is measured of bodies in motion."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64, Int64

from perpetua.actors.checks.penetration import Worst


@dataclass(frozen=True)
class ActorFigures:
    """How one actor does.

    Slide is the speed over the floor of soles that stand; ``..._99th_m`` is what 99 of 100 standing soles stay under.
    ``hands_in_trunk`` is reported only: hands may rest on a body whose clothes give way.
    """

    actor: int
    slide_median_mps: float
    slide_95th_mps: float
    sole_penetration: Worst
    sole_penetration_99th_m: float
    floating: Worst
    floating_99th_m: float
    scene_depth: Worst
    path_error: Worst
    joint_excess_rad: float
    joint_excess_at: str
    hands_in_trunk: Worst


@dataclass(frozen=True)
class PairFigures:
    """Least distance of two actors at each checked frame; negative is how deep they are in each other."""

    actors: tuple[int, int]
    frames: Int64[np.ndarray, " K"]
    distance_m: Float64[np.ndarray, " K"]


@dataclass(frozen=True)
class ActorReport:
    """Figures of all actors and pairs of actors."""

    actors: tuple[ActorFigures, ...]
    pairs: tuple[PairFigures, ...]

    def to_json(self) -> dict[str, Any]:
        """The report in plain numbers, texts, lists and dictionaries."""
        return {
            "actors": [asdict(figures) for figures in self.actors],
            "pairs": [
                {
                    "actors": list(pair.actors),
                    "least_distance_m": float(pair.distance_m.min()),
                    "frame": int(pair.frames[pair.distance_m.argmin()]),
                    "frames": pair.frames.tolist(),
                    "distance_m": pair.distance_m.tolist(),
                }
                for pair in self.pairs
            ],
        }
