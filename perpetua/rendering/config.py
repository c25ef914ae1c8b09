"""Settings of the render stage."""

from pydantic import Field

from perpetua.config_base import Section


class RenderConfig(Section):
    """What Blender is asked for."""

    width_px: int = Field(512, ge=16, le=4096, description="image width, pixels")
    height_px: int = Field(512, ge=16, le=4096, description="image height, pixels")
    samples: int = Field(32, ge=1, le=16384, description="Cycles samples per pixel")
    denoise: bool = Field(True, description="denoise with Open Image Denoise, guided by albedo and normal")
    noise_threshold: float = Field(
        0.05,
        ge=0.0,
        le=1.0,
        description="noise at which a pixel gets no more samples, as a share; 0: always all samples",
    )
    max_bounces: int = Field(4, ge=0, le=64, description="light bounces")
    view_transform: str = Field("AgX", description="Blender view transform of the pictures: AgX, Filmic or Standard")
    look: str = Field("AgX - Medium High Contrast", description="Blender look of the view transform, or None")
    white_balance: float = Field(
        0.7, ge=0.0, le=1.0, description="share of the lamps' colour cast that the camera takes out; 0: none"
    )
    jpeg_quality: int = Field(95, ge=1, le=100, description="JPEG quality")
    bake: bool = Field(
        True, description="bake a room's procedural materials to images where that saves time; false: never"
    )
    max_texels: int = Field(
        8_000_000, ge=10_000, le=100_000_000, description="most texels baked from a room's procedural materials"
    )
    frame_timeout_s: float = Field(1800.0, ge=5.0, description="longest time without progress, seconds")
    max_restarts: int = Field(3, ge=0, le=100, description="restarts of Blender after a crash or a hang")
    threads: int = Field(0, ge=0, le=1024, description="CPU threads of Blender; 0: all")
    blender: str | None = Field(None, description="a Blender program to render with; none: the bpy package")
