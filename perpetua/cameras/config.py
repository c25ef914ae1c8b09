"""Settings of the camera stage."""

from pydantic import Field

from perpetua.config_base import Section


class CamerasConfig(Section):
    """How many cameras, how they may move, and the hard limits they keep."""

    count: int = Field(4, ge=1, le=32, description="synchronized views")
    min_fov_deg: float = Field(55.0, ge=20.0, le=120.0, description="narrowest horizontal field of view, degrees")
    max_fov_deg: float = Field(80.0, ge=20.0, le=120.0, description="widest horizontal field of view, degrees")
    voxel_m: float = Field(0.06, ge=0.02, le=0.2, description="voxel of the signed distance field, metres")
    scene_clearance_m: float = Field(0.15, ge=0.05, le=1.0, description="least distance to the scene, metres")
    actor_clearance_m: float = Field(0.30, ge=0.05, le=2.0, description="least distance to an actor, metres")
    candidates: int = Field(4, ge=1, le=64, description="sets of camera paths optimised; the best one wins")
    steps: int = Field(300, ge=10, le=10000, description="Adam steps")
    max_redraws: int = Field(5, ge=0, le=100, description="new sets of candidates tried when none passes")
