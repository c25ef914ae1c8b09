"""Settings of the navigation stage."""

from pydantic import Field

from perpetua.io.section import Section


class NavigationConfig(Section):
    """The body that walks and the grid it walks on."""

    cell_m: float = Field(0.05, ge=0.02, le=0.2, description="side of a grid cell, metres")
    body_radius_m: float = Field(0.28, ge=0.1, le=0.6, description="radius kept free around a person, metres")
    body_height_m: float = Field(1.95, ge=1.0, le=2.5, description="head room a person needs, metres")
    step_m: float = Field(0.08, ge=0.0, le=0.3, description="highest step or rug walked over, metres")
    min_region_m2: float = Field(
        2.0, ge=0.0, le=100.0, description="connected free floor smaller than this is not walked on, square metres"
    )
