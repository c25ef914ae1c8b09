"""SMPL-X model files for the conformance suite: synthetic ones of the true shapes and keys."""

from pathlib import Path

from perpetua.actors.config import ActorsConfig, SmplxConfig
from tests.support.smplx_files import write_model


def actors_config(folder: Path) -> ActorsConfig:
    """The model's config, with the files it reads in ``folder``."""
    write_model(folder / "SMPLX_FEMALE.npz", size=0.96)
    write_model(folder / "SMPLX_MALE.npz", size=1.04)
    return ActorsConfig(body="smplx", smplx=SmplxConfig(folder=str(folder)))
