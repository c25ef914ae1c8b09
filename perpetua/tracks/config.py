"""Settings of the track stage."""

from pydantic import Field

from perpetua.config_base import Section


class TracksConfig(Section):
    """How many points, of which classes, and when one counts as visible."""

    count: int = Field(1024, ge=1, le=10_000_000, description="tracks of a sequence")
    dynamic_share: float = Field(0.3, ge=0.0, le=1.0, description="share of tracks that move more than 5 cm")
    min_visible: int = Field(2, ge=1, description="least number of (view, frame) pairs a track is visible in")
    tolerance_m: float = Field(0.005, gt=0.0, le=0.1, description="depth tolerance, constant part, metres")
    tolerance_share: float = Field(0.005, ge=0.0, le=0.1, description="depth tolerance, share of the depth")
