"""Settings of the track stage."""

from pydantic import Field

from perpetua.io.section import Section


class TracksConfig(Section):
    """How many points, of which classes, and when one counts as visible.

    A rendered surface may lie a little in front of the point's own (``tolerance``, sharp, so that whatever covers
    the point hides it) and a little further behind it (``behind``: a curved surface that bends away covers nothing).
    """

    count: int = Field(1024, ge=1, le=10_000_000, description="tracks of a sequence")
    dynamic_share: float = Field(0.3, ge=0.0, le=1.0, description="share of tracks that move more than 5 cm")
    fast_share: float = Field(
        0.1,
        ge=0.0,
        le=1.0,
        description="least share of tracks that move more than 2 m within 24 frames, as far as actors are that fast",
    )
    min_visible: int = Field(2, ge=1, description="least number of (view, frame) pairs a track is visible in")
    tolerance_m: float = Field(
        0.003, gt=0.0, le=0.1, description="farthest a visible point lies behind rendered depth, constant part, metres"
    )
    tolerance_share: float = Field(
        0.002, ge=0.0, le=0.1, description="farthest a visible point lies behind rendered depth, share of the depth"
    )
    behind_m: float = Field(
        0.008,
        gt=0.0,
        le=0.1,
        description="farthest a visible point lies in front of rendered depth, constant part, metres",
    )
    behind_share: float = Field(
        0.008,
        ge=0.0,
        le=0.1,
        description="farthest a visible point lies in front of rendered depth, share of the depth",
    )
    candidates: float = Field(
        4.0, ge=1.0, le=100.0, description="points drawn for each track wanted, of which the best spread are kept"
    )
    max_draws: int = Field(6, ge=1, le=100, description="rounds of drawing before too few visible points are an error")
