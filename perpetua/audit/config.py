"""Bounds of the audit."""

from pydantic import Field

from perpetua.io.section import Section


class AuditConfig(Section):
    """What a finished sequence must satisfy.

    Bounds that the planners or the format have too, such as ``moving_m``, are the audit's own, so that it stays
    independent of the code whose output it checks.
    """

    reprojection_px: float = Field(1e-3, gt=0.0, description="largest error of a query's pixel, pixels")
    depth_agreement: float = Field(
        0.99, ge=0.0, le=1.0, description="share of visible entries whose rendered depth must agree"
    )
    depth_tolerance_m: float = Field(0.01, gt=0.0, description="depth agreement, constant part, metres")
    depth_tolerance_share: float = Field(0.01, ge=0.0, description="depth agreement, share of the depth")
    point_depth_agreement: float = Field(
        0.9, ge=0.0, le=1.0, description="the same where no surfaces are stored, only the points' own depths"
    )
    foreground_agreement: float = Field(
        0.99,
        ge=0.0,
        le=1.0,
        description="share of visible entries whose pixel must be foreground just when on an actor",
    )
    unexplained_hidden: float = Field(
        0.02, ge=0.0, le=1.0, description="largest share of entries called hidden although depth shows their surface"
    )
    seen_through: float = Field(
        0.03, ge=0.0, le=1.0, description="largest share of pixels whose surface another view sees through"
    )
    max_depth_m: float = Field(100.0, gt=0.0, description="largest depth of an indoor scene, metres")
    rotation_error: float = Field(1e-5, gt=0.0, description="largest entry of R times its transpose minus identity")
    surface_error_m: float = Field(1e-4, gt=0.0, description="largest distance of a track from its triangle, metres")
    deep_depth_m: float = Field(
        0.001, gt=0.0, description="verify --deep: depth off silhouettes, constant part, metres"
    )
    deep_depth_share: float = Field(
        1e-4, ge=0.0, description="verify --deep: depth off silhouettes, share of the depth"
    )
    deep_agreement: float = Field(
        0.999, ge=0.0, le=1.0, description="verify --deep: share of pixels whose depth and object must agree with rays"
    )
    deep_visibility: float = Field(
        0.999, ge=0.0, le=1.0, description="verify --deep: share of visibility entries that must agree with rays"
    )
    moving_m: float = Field(
        0.05, gt=0.0, description="a track moves when two of its positions are so far apart, metres"
    )
    moving_share: float = Field(
        0.3, ge=0.0, le=1.0, description="share of tracks that move, where the sequence does not record the wanted one"
    )
    moving_share_slack: float = Field(0.05, ge=0.0, le=1.0, description="largest difference of that share")
