"""Settings of the motion stage."""

from typing import Literal

from pydantic import Field

from perpetua.io.section import Section


class ClipsConfig(Section):
    """Recorded motion from a folder of .npz (AMASS, SMPL-X, BEDLAM2) and .bvh files."""

    folder: str = Field(
        "",
        description="folder of clips, matched by file names and by its index.yaml (file name: description); "
        "empty for motion/clips in the asset folder",
    )
    up: Literal["auto", "y", "z"] = Field("auto", description="axis along which recorded bodies stand: auto, y or z")
    from_start: bool = Field(False, description="play clips from their first frame, not from one drawn by the seed")


class KimodoConfig(Section):
    """Motion from text by NVIDIA's Kimodo, an outside program."""

    program: str = Field("kimodo_gen", description="the program: a name on PATH or a path")
    model: str = Field("Kimodo-SOMA-RP-v1", description="Kimodo's model; its SOMA and SMPL-X models can be read")
    version: str = Field("", description="version of Kimodo that made what is cached, part of the cache's key")
    timeout_s: float = Field(1800.0, gt=0.0, le=86_400.0, description="longest time one generation may take, seconds")
    max_path_error_m: float = Field(
        0.5, gt=0.0, le=5.0, description="farthest that a generated path may be from the route, metres"
    )


class MotionConfig(Section):
    """Where full-body motion comes from."""

    source: str = Field("procedural", description="motion source: procedural, clips or kimodo")
    clips: ClipsConfig = Field(default_factory=ClipsConfig)
    kimodo: KimodoConfig = Field(default_factory=KimodoConfig)
    actions: str = Field("everyday", description="list of action descriptions to draw from: a name in configs/actions")
    descriptions: tuple[str, ...] = Field(
        (), description="action descriptions in plain words to draw from instead of the list, one per actor"
    )
