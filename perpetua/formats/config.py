"""Settings of the export stage."""

import re
from math import isclose
from typing import Literal, get_args

from pydantic import Field, field_validator

from perpetua.io.section import Section
from perpetua.seeding import stream

Output = Literal["object_index", "normals", "flow", "scene_flow", "view_flow"]
OUTPUTS: tuple[str, ...] = get_args(Output)

_FOLDER_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]*")


class ExportConfig(Section):
    """Where a finished sequence goes and what is kept."""

    splits: dict[str, float] = Field(
        default={"train": 1.0},
        description="folders of the data splits, each with its share of the rooms, for example {train: 0.9, val: 0.1}; "
        "shares are in 0..1 and sum to 1",
    )
    outputs: tuple[Output, ...] = Field(
        default=(),
        description="labels of every pixel to write beside depth: object_index, normals, flow and scene_flow (to the "
        "next frame), view_flow (to each other view); for example [normals, flow]",
    )

    @field_validator("splits")
    @classmethod
    def _fractions_sum_to_one(cls, splits: dict[str, float]) -> dict[str, float]:
        for name, fraction in splits.items():
            if _FOLDER_NAME.fullmatch(name) is None:
                raise ValueError(f"must have names of letters, digits, '-' and '_', so '{name}' cannot be a split")
            if not 0.0 <= fraction <= 1.0:
                raise ValueError(f"must have shares in 0..1, so '{name}' cannot have {fraction}")
        if not isclose(sum(splits.values()), 1.0, abs_tol=1e-6):
            raise ValueError(f"must have shares that sum to 1, and they sum to {sum(splits.values()):g}")
        return splits


def split_of_room(config: ExportConfig, seed: int, room: int) -> str:
    """The split that a room goes to.

    It is drawn for each room by itself, so it stays as more rooms are made; the names of the splits count, not the
    order in which they are written.
    """
    drawn = stream(seed, room, "export", "split").random()
    taken = [name for name in sorted(config.splits) if config.splits[name] > 0.0]
    end = 0.0
    for name in taken:
        end += config.splits[name]
        if drawn < end:
            return name
    return taken[-1]
