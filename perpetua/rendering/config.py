"""Settings of the render stage."""

from typing import Literal

from pydantic import Field, model_validator

from perpetua.io.section import Section
from perpetua.rendering.sensor import SensorConfig

# Settings of how the work is done, which do not change what comes out.
PROCESS_SETTINGS = frozenset({"frame_timeout_s", "max_restarts", "blender", "threads"})


class RenderConfig(Section):
    """What Blender is asked for."""

    width_px: int = Field(512, ge=16, le=4096, description="image width, pixels")
    height_px: int = Field(512, ge=16, le=4096, description="image height, pixels")
    engine: Literal["cycles", "eevee"] = Field(
        "cycles",
        description="what draws the pictures; eevee needs a graphics driver and its light is less exact. Depth and "
        "object index come from Cycles either way",
    )
    samples: int = Field(32, ge=1, le=16384, description="samples per pixel")
    denoise: bool = Field(True, description="denoise with Open Image Denoise, guided by albedo and normal")
    denoise_guides: Literal["none", "fast", "accurate"] = Field(
        "accurate", description="how albedo and normal are themselves denoised first: none, fast or accurate"
    )
    noise_threshold: float = Field(
        0.05,
        ge=0.0,
        le=1.0,
        description="noise at which a pixel gets no more samples, as a share; 0: always all samples",
    )
    max_bounces: int = Field(4, ge=0, le=64, description="light bounces")
    light_tree: bool = Field(False, description="pick the lamp for each ray by a tree of all lamps")
    clamp_indirect: float = Field(
        4.0, ge=0.0, description="brightest light that a bounced ray may bring, in the room's own units; 0: any"
    )
    motion_blur: bool = Field(
        False, description="blur pictures by motion of camera and actors; depth and object index never are"
    )
    shutter: float = Field(0.5, gt=0.0, le=1.0, description="how long motion blur exposes, as a share of a frame")
    sensor: SensorConfig = Field(default_factory=SensorConfig)
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
        8_000_000,
        ge=10_000,
        le=100_000_000,
        description="most texels of a room's baked colours; each takes 14 bytes, with all else",
    )
    frame_timeout_s: float = Field(1800.0, ge=5.0, description="longest time without progress, seconds")
    max_restarts: int = Field(
        3, ge=0, le=100, description="restarts of Blender after a crash or a hang, in a row without a new frame"
    )
    threads: int = Field(0, ge=0, le=1024, description="CPU threads of Blender; 0: the cores, shared among workers")
    blender: str | None = Field(None, description="a Blender program to render with; none: the bpy package")

    @model_validator(mode="after")
    def _blur_needs_cycles(self) -> "RenderConfig":
        if self.motion_blur and self.engine == "eevee":
            raise ValueError("motion_blur needs engine cycles: eevee does not blur bodies that change their shape")
        return self
