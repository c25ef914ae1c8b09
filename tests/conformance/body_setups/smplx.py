"""SMPL-X model files for the conformance suite: synthetic ones of the true shapes and keys."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "unit"))

from smplx_files import write_model

from perpetua.actors.config import ActorsConfig, SmplxConfig


def actors_config(folder: Path) -> ActorsConfig:
    """The model's config, with the files it reads in ``folder``."""
    write_model(folder / "SMPLX_FEMALE.npz", size=0.96)
    write_model(folder / "SMPLX_MALE.npz", size=1.04)
    return ActorsConfig(body="smplx", smplx=SmplxConfig(folder=str(folder)))
