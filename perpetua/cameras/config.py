"""Settings of the camera stage."""

from typing import Literal

from pydantic import Field, model_validator

from perpetua.io.section import Section

Framing = Literal["close", "medium", "wide"]
Height = Literal["floor", "table", "eye", "ceiling"]
Style = Literal["dolly", "orbit", "handheld", "walk_along", "static"]


class CameraWeights(Section):
    """How much each loss of the trajectory optimisation counts (all losses are without unit)."""

    scene_clearance: float = Field(60.0, ge=0.0, description="weight of the distance to the scene")
    actor_clearance: float = Field(60.0, ge=0.0, description="weight of the distance to actors")
    framing: float = Field(40.0, ge=0.0, description="weight of the focus lying inside the image")
    size: float = Field(3.0, ge=0.0, description="weight of the focus being as high in the image as its framing asks")
    coverage: float = Field(12.0, ge=0.0, description="weight of every actor being seen by two views")
    occlusion: float = Field(30.0, ge=0.0, description="weight of a clear line of sight past furniture")
    crowding: float = Field(8.0, ge=0.0, description="weight of a clear line of sight past other actors")
    foreground: float = Field(15.0, ge=0.0, description="weight of no actor filling the image from close by")
    smoothness: float = Field(0.3, ge=0.0, description="weight of small acceleration of position")
    rotation: float = Field(1.0, ge=0.0, description="weight of slow and steady turning")
    limits: float = Field(30.0, ge=0.0, description="weight of the limits of speed, acceleration and turning")
    travel: float = Field(8.0, ge=0.0, description="weight of moving as fast and as far as the style asks")
    revisiting: float = Field(0.5, ge=0.0, description="weight of not coming back to a place")
    diversity: float = Field(8.0, ge=0.0, description="weight of views from different directions")
    height: float = Field(3.0, ge=0.0, description="weight of the view's height above the floor")
    pitch: float = Field(20.0, ge=0.0, description="weight of not looking too steeply up or down")
    offset: float = Field(1.0, ge=0.0, description="weight of looking at the focus rather than beside it")


class CamerasConfig(Section):
    """How many cameras, how they may move, and the hard limits they keep."""

    count: int = Field(4, ge=1, le=32, description="synchronized views")
    min_fov_deg: float = Field(35.0, ge=20.0, le=120.0, description="narrowest horizontal field of view, degrees")
    max_fov_deg: float = Field(90.0, ge=20.0, le=120.0, description="widest horizontal field of view, degrees")
    framings: tuple[Framing, ...] = Field(
        ("wide", "medium", "wide", "close"), min_length=1, description="framings, dealt to the views at random"
    )
    heights: tuple[Height, ...] = Field(
        ("eye", "table", "ceiling", "floor"), min_length=1, description="heights, dealt to the views at random"
    )
    styles: tuple[Style, ...] = Field(
        ("dolly", "orbit", "handheld", "walk_along"),
        min_length=1,
        description="ways to move, dealt at random; a static view stands on a tripod and only turns",
    )
    sway_m: float = Field(0.012, ge=0.0, le=0.1, description="amplitude of hand-held sway, metres")
    sway_deg: float = Field(0.6, ge=0.0, le=5.0, description="amplitude of hand-held turning and roll, degrees")
    voxel_m: float = Field(0.06, ge=0.02, le=0.2, description="voxel of the signed distance field, metres")
    scene_clearance_m: float = Field(0.15, ge=0.05, le=1.0, description="least distance to the scene, metres")
    actor_clearance_m: float = Field(0.30, ge=0.05, le=2.0, description="least distance to an actor, metres")
    max_speed_mps: float = Field(1.6, gt=0.0, le=10.0, description="hard limit of speed, m/s")
    max_acceleration_mps2: float = Field(6.0, gt=0.0, le=50.0, description="hard limit of acceleration, m/s^2")
    max_turn_deg_per_s: float = Field(120.0, gt=0.0, le=720.0, description="hard limit of turning, degrees/s")
    max_pitch_deg: float = Field(65.0, ge=20.0, le=80.0, description="steepest view up or down, degrees")
    min_focus_share: float = Field(
        0.75, ge=0.0, le=1.0, description="least share of frames in which a view sees one of its focus actors"
    )
    covering_views: int = Field(
        2, ge=0, le=32, description="views that are to see each actor at each time; of fewer than 4 views half do"
    )
    min_covered_share: float = Field(
        0.7, ge=0.0, le=1.0, description="least share of frames in which covering_views views see an actor"
    )
    min_apart_deg: float = Field(
        40.0, ge=0.0, le=180.0, description="least mean angle between the two most different views of an actor, degrees"
    )
    candidates: int = Field(4, ge=1, le=64, description="sets of camera paths optimised; the best one wins")
    steps: int = Field(800, ge=0, le=10000, description="Adam steps; 0 keeps the starts")
    max_redraws: int = Field(5, ge=0, le=100, description="new sets of candidates tried when none passes")
    weights: CameraWeights = Field(default_factory=CameraWeights)

    @model_validator(mode="after")
    def _check_order(self) -> "CamerasConfig":
        if self.min_fov_deg > self.max_fov_deg:
            raise ValueError(f"min_fov_deg must not exceed max_fov_deg: {self.min_fov_deg} > {self.max_fov_deg}")
        return self

    @property
    def views_per_actor(self) -> int:
        """How many of the views are to see each actor at each time."""
        return min(self.covering_views, self.count // 2)
