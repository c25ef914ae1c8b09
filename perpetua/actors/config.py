"""Settings of the route, motion and actor stages."""

from typing import Literal

from pydantic import Field, model_validator

from perpetua.config_base import Section


class PaceShares(Section):
    """How often an actor goes at each pace, unless words state one; only the proportions count."""

    stand: float = Field(0.06, ge=0.0, description="staying at one place and looking around")
    stroll: float = Field(0.20, ge=0.0, description="strolling")
    walk: float = Field(0.36, ge=0.0, description="walking")
    brisk: float = Field(0.20, ge=0.0, description="walking briskly")
    jog: float = Field(0.18, ge=0.0, description="jogging")

    @model_validator(mode="after")
    def _check_some(self) -> "PaceShares":
        if not any(self.model_dump().values()):
            raise ValueError("at least one share must be more than 0")
        return self


class PaceSpeeds(Section):
    """Typical speeds on free floor, m/s."""

    stroll: float = Field(0.75, gt=0.0, le=6.0, description="strolling, m/s")
    walk: float = Field(1.15, gt=0.0, le=6.0, description="walking, m/s")
    brisk: float = Field(1.6, gt=0.0, le=6.0, description="walking briskly, m/s")
    jog: float = Field(2.75, gt=0.0, le=6.0, description="jogging, m/s")


class RouteWeights(Section):
    """How much each loss of the route optimisation counts; 0 switches it off."""

    clearance: float = Field(400.0, ge=0.0, description="keeping off obstacles")
    separation: float = Field(400.0, ge=0.0, description="actors keeping apart")
    speed: float = Field(50.0, ge=0.0, description="staying under the pace's highest speed")
    acceleration: float = Field(5.0, ge=0.0, description="staying under the limit of acceleration")
    jerk: float = Field(0.002, ge=0.0, description="changing acceleration slowly")
    heading: float = Field(20.0, ge=0.0, description="facing where one walks")
    turning: float = Field(20.0, ge=0.0, description="staying under the limit of the turn rate")
    turn_change: float = Field(0.02, ge=0.0, description="changing the turn rate slowly")
    variation: float = Field(0.4, ge=0.0, description="not coming back to where one has been")
    walk: float = Field(2.0, ge=0.0, description="staying near the random walk")
    pause: float = Field(50.0, ge=0.0, description="pausing where and facing what was planned")


class RoutesConfig(Section):
    """How actors move through the room, and the hard limits they keep."""

    paces: PaceShares = Field(default_factory=PaceShares)
    speeds: PaceSpeeds = Field(default_factory=PaceSpeeds)
    pause_share: float = Field(
        0.2, ge=0.0, le=0.9, description="share of time that walking actors pause at what there is to see or to use"
    )
    max_speed_mps: float = Field(3.4, gt=0.0, le=8.0, description="hard limit of speed, m/s")
    max_acceleration_mps2: float = Field(5.0, gt=0.0, le=20.0, description="hard limit of acceleration, m/s^2")
    max_turn_rate_radps: float = Field(3.2, gt=0.2, le=10.0, description="hard limit of the turn rate, rad/s")
    separation_m: float = Field(0.75, ge=0.2, le=3.0, description="least distance between two body axes, metres")
    learning_rate: float = Field(0.05, gt=0.0, le=1.0, description="Adam's first step size, metres and radians")
    steps: int = Field(300, ge=10, le=10000, description="Adam steps")
    weights: RouteWeights = Field(default_factory=RouteWeights)
    max_redraws: int = Field(20, ge=0, le=500, description="new walks tried when a route breaks a limit")


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
    hat_share: float = Field(0.15, ge=0.0, le=1.0, description="share of people who wear a hat, where there are hats")


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
