"""Bounds of the audit."""

from pydantic import Field

from perpetua.config_base import Section


class AuditConfig(Section):
    """What a finished sequence must satisfy."""

    reprojection_px: float = Field(1e-3, gt=0.0, description="largest error of a query's pixel, pixels")
    depth_agreement: float = Field(
        0.99, ge=0.0, le=1.0, description="share of visible entries whose rendered depth must agree"
    )
    depth_tolerance_m: float = Field(0.01, gt=0.0, description="depth agreement, constant part, metres")
    depth_tolerance_share: float = Field(0.01, ge=0.0, description="depth agreement, share of the depth")
