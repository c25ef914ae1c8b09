"""Settings of the actor stage, and the section that holds those of the people altogether."""

from typing import Literal

from pydantic import Field, model_validator

from perpetua.io.section import Section
from perpetua.motion.config import MotionConfig
from perpetua.routes.config import RoutesConfig


class ValidationConfig(Section):
    """Hard limits on bodies in motion, and how closely they are looked at."""

    max_slide_mps: float = Field(
        0.04, gt=0.0, le=1.0, description="highest 95th percentile of the speed of a sole while it stands, m/s"
    )
    max_median_slide_mps: float = Field(
        0.01, gt=0.0, le=1.0, description="highest median of the speed of a sole while it stands, m/s"
    )
    max_sole_penetration_m: float = Field(
        0.01, gt=0.0, le=0.2, description="depth of soles in the floor that 99% of standing ones stay under, metres"
    )
    max_floating_m: float = Field(
        0.015, gt=0.0, le=0.2, description="height over the floor that 99% of standing soles stay under, metres"
    )
    max_scene_depth_m: float = Field(0.02, gt=0.0, le=1.0, description="deepest body in furniture or walls, metres")
    max_actor_overlap_m: float = Field(0.005, ge=0.0, le=1.0, description="deepest actor in another, metres")
    max_path_error_m: float = Field(
        0.15, gt=0.0, le=1.0, description="farthest pelvis from its route, metres, except while it sits"
    )
    max_joint_excess_rad: float = Field(
        0.15, gt=0.0, le=3.2, description="how far a joint may be beyond what people can do, radians"
    )
    step_m: float = Field(
        0.1, ge=0.0, le=0.3, description="what stands no higher than this on the floor is stepped over, metres"
    )
    frames: int = Field(
        240, ge=2, le=100_000, description="frames in which bodies are checked against their surroundings"
    )
    vertices: int = Field(2000, ge=100, le=1_000_000, description="vertices of a body that are checked in a frame")


class ClothingConfig(Section):
    """What bodies of the model anny wear."""

    source: Literal["tailored", "makehuman"] = Field(
        "tailored", description="where clothes come from: tailored (made here) or makehuman (a folder of assets)"
    )
    folder: str = Field(
        "",
        description="folder of MakeHuman assets that holds clothes, hair, eyebrows and skins; "
        "empty for makehuman in the asset folder",
    )
    hat_share: float = Field(
        0.15, ge=0.0, le=1.0, description="share of people who wear a hat, if the wardrobe has hats"
    )


class SmplxConfig(Section):
    """SMPL-X bodies from a licence holder's model files, and BEDLAM2's textures for them."""

    folder: str = Field(
        "", description="folder of SMPLX_{NEUTRAL,MALE,FEMALE}.npz; empty for smplx in the asset folder"
    )
    betas: int = Field(10, ge=1, le=300, description="shape directions that bodies are drawn with")
    textures: str = Field(
        "",
        description="folder of BEDLAM2 textures (bald/skin_*_ALB, gr_*/texture_*/*_diffuse); "
        "empty for bedlam2 in the asset folder, where there is one",
    )


class ActorsConfig(Section):
    """Who is in the room."""

    count: int = Field(4, ge=1, le=16, description="actors in a room")
    body: str = Field("anny", description="body model: anny or smplx")
    clothing: ClothingConfig = Field(default_factory=ClothingConfig)
    smplx: SmplxConfig = Field(default_factory=SmplxConfig)
    youngest_years: float = Field(20.0, ge=18.0, le=90.0, description="age of the youngest people, years")
    oldest_years: float = Field(70.0, ge=18.0, le=90.0, description="age of the oldest people, years")
    routes: RoutesConfig = Field(default_factory=RoutesConfig)
    motion: MotionConfig = Field(default_factory=MotionConfig)
    validation: ValidationConfig = Field(default_factory=ValidationConfig)

    @model_validator(mode="after")
    def _check_clothes_fit(self) -> "ActorsConfig":
        if self.clothing.source == "makehuman" and self.body != "anny":
            raise ValueError("MakeHuman's clothes are bound to the body anny: set body to anny or source to tailored")
        return self
