"""Settings of the room stage."""

from typing import Literal

from pydantic import Field, model_validator

from perpetua.io.section import Section

RoomKind = Literal["bathroom", "bedroom", "diningroom", "kitchen", "livingroom"]
Daytime = Literal["day", "evening", "night"]


class SceneFileConfig(Section):
    """The scene file that rooms.source 'file' reads."""

    path: str | None = Field(
        None, description="a .blend, .glb, .gltf or .obj file, or a folder with some, from which the seed picks"
    )
    kind: RoomKind | Literal["scene"] = Field(
        "scene", description="what the rooms are; 'scene' for anything: then nothing says what must be in it"
    )
    metres_per_unit: float | None = Field(
        None, gt=0.0, le=10_000.0, description="length of one unit of the file, metres; none: as the file says, else 1"
    )
    up_axis: Literal["auto", "y", "z"] = Field(
        "auto", description="the file's axis that points up; auto: y in glTF and OBJ, z in .blend"
    )
    floor_z_m: float | None = Field(
        None, description="height of the floor in the file, metres along the up axis; none: it is found"
    )
    max_file_mb: float = Field(500.0, gt=0.0, description="largest file that is opened, with what it refers to, MB")


class RoomsConfig(Section):
    """Where rooms come from and what makes one acceptable."""

    source: str = Field("infinigen", description="room source: infinigen, procedural or file")
    kinds: tuple[RoomKind, ...] = Field(
        ("bathroom", "bedroom", "diningroom", "kitchen", "livingroom"),
        description="room kinds to draw from",
        min_length=1,
    )
    min_side_m: float = Field(
        5.0, ge=3.0, le=12.0, description="shortest side of the floor (Infinigen's bathrooms: a fifth less), metres"
    )
    max_side_m: float = Field(7.0, ge=3.0, le=15.0, description="longest side of the floor, metres")
    min_height_m: float = Field(2.5, ge=2.2, le=5.0, description="lowest ceiling, metres")
    max_height_m: float = Field(3.1, ge=2.2, le=6.0, description="highest ceiling, metres")
    daytimes: tuple[Daytime, ...] = Field(
        ("day", "day", "evening", "night"), description="times of day to draw from", min_length=1
    )
    lamps: Literal["drawn", "on", "off"] = Field(
        "drawn", description="lamps by day: on, off, or drawn; in the evening and at night 'drawn' means on"
    )
    min_free_floor_m2: float = Field(
        6.0, ge=1.0, le=200.0, description="least connected floor that a person can walk on, square metres"
    )
    max_redraws: int = Field(5, ge=0, le=50, description="further rooms tried when one is rejected")
    timeout_s: float = Field(600.0, ge=10.0, description="longest time to generate one room, seconds")
    max_memory_mb: float = Field(
        4000.0, ge=500.0, description="memory that the process which generates a room may take, megabytes"
    )
    max_triangles: int = Field(3_000_000, ge=1000, description="triangles allowed in one room")
    file: SceneFileConfig = Field(default_factory=SceneFileConfig)

    @model_validator(mode="after")
    def _check_order(self) -> "RoomsConfig":
        for low, high in (("min_side_m", "max_side_m"), ("min_height_m", "max_height_m")):
            if getattr(self, low) > getattr(self, high):
                raise ValueError(f"{low} must not exceed {high}: {getattr(self, low)} > {getattr(self, high)}")
        return self
