"""A picture of actors: each stands seen from four sides and from near, and walks."""

import io
import math
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64
from PIL import Image, ImageDraw

from perpetua.actors.bodies.assembly import draw_bodies
from perpetua.actors.bodies.source import Body
from perpetua.actors.config import ActorsConfig
from perpetua.config import Config
from perpetua.geometry.mesh import TriMesh
from perpetua.geometry.pinhole import Intrinsics
from perpetua.geometry.transforms import look_at
from perpetua.motion.plan import make_motions
from perpetua.rendering.render import render_views
from perpetua.report.pictures.drawing import BACKGROUND, INK, text_font
from perpetua.scene.actor import BODY_JOINTS, ActorMesh, ActorPart, BodyMotion, Route
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import AreaLight, Material, Room, SceneObject
from perpetua.seeding import StageSeed

HEIGHT_PX = 400
CELL_M, SCALE_PX_PER_M = 0.92, 196.0
TURNS_RAD = tuple(math.radians(angle) for angle in (0.0, 90.0, 180.0, 270.0))
WALK_FRAMES = (24, 30, 36, 42, 48)
FPS = 24.0
WALK_SPEED_MPS = 1.2
SAMPLES = 8
_ROUTE_FRAMES = 73
_NEAR_WIDTH_PX, _NEAR_M, _NEAR_TURN_RAD = 340, 0.62, math.radians(25.0)
_FAR_AWAY_M = 25.0
_CAPTION_PX = 24


@dataclass(frozen=True)
class _Cell:
    """One figure of a row: a pose in the world, the place its body axis has there, and a turn about Z."""

    vertices_m: Float32[np.ndarray, "P 3"]
    axis_m: Float64[np.ndarray, "3"]
    turn_rad: float


def write_actor_sheet(count: int, seed: int, config: Config, device: str, picture: Path) -> None:
    """Writes a picture with a row for each of ``count`` actors, the people of the first rooms of a seed.

    A row shows the upper body from near, four sides standing, and five moments of a walk from the side.

    Args:
        count: at least 1.
        seed: the seed that ``generate`` takes.
        config: the whole config; actors and render sections count.
        device: what Cycles renders on.
        picture: file to write.

    Raises:
        RenderError: Blender failed.
    """
    rows = [
        _row(body, StageSeed(seed, index // config.actors.count, "motion"), index % config.actors.count, config, device)
        for index, body in enumerate(_people(count, seed, config.actors))
    ]
    sheet = Image.new("RGB", (rows[0].width, sum(row.height for row in rows)), BACKGROUND)
    for index, row in enumerate(rows):
        sheet.paste(row, (0, index * row.height))
    sheet.save(picture)


def _people(count: int, seed: int, config: ActorsConfig) -> list[Body]:
    rooms = range(math.ceil(count / config.count))
    return [body for room in rooms for body in draw_bodies(config, StageSeed(seed, room, "bodies"))][:count]


def _row(body: Body, seed: StageSeed, actor: int, config: Config, device: str) -> Image.Image:
    cells = _cells(body, actor, seed, config.actors)
    near_m = _eye_level_m(body)
    cameras = (_row_camera(len(cells)), _near_camera(len(cells), near_m))
    # Plain sampling of few rays costs less here than denoising does.
    settings = config.render.model_copy(
        update={"samples": SAMPLES, "max_bounces": 1, "denoise": False, "white_balance": 0.0}
    )
    with tempfile.TemporaryDirectory() as folder:
        views = render_views(
            studio(), (_lined_up(body, cells),), cameras, settings, device, Path(folder), lambda *_: None
        )
        # JPEG is decoded here, while the files behind the views are there.
        row, near = (_decoded(view.jpeg[0]) for view in views)
    picture = Image.new("RGB", (near.width + row.width, HEIGHT_PX + _CAPTION_PX), BACKGROUND)
    picture.paste(near, (0, _CAPTION_PX))
    picture.paste(row, (near.width, _CAPTION_PX))
    ImageDraw.Draw(picture).text((8, 4), f"room {seed.room}, actor {actor}: {body.description}", INK, text_font(14))
    return picture


def _decoded(jpeg: bytes) -> Image.Image:
    picture = Image.open(io.BytesIO(jpeg))
    picture.load()
    return picture


def _cells(body: Body, actor: int, seed: StageSeed, config: ActorsConfig) -> list[_Cell]:
    standing = _motion(body, actor, seed, config, 0.0, "stands")
    walking = _motion(body, actor, seed, config, WALK_SPEED_MPS, "walks")
    still_m = body.pose(_at(standing, [_ROUTE_FRAMES - 1]))[0]
    walk_m = body.pose(_at(walking, list(WALK_FRAMES)))
    cells = [_Cell(still_m, standing.pelvis_m[-1] * (1.0, 1.0, 0.0), turn) for turn in TURNS_RAD]
    sideways = math.radians(90.0)
    for frame, vertices_m in zip(WALK_FRAMES, walk_m, strict=True):
        cells.append(_Cell(vertices_m, walking.pelvis_m[frame] * (1.0, 1.0, 0.0), sideways))
    return cells


def _motion(
    body: Body, actor: int, seed: StageSeed, config: ActorsConfig, speed_mps: float, description: str
) -> BodyMotion:
    along_m = (np.arange(_ROUTE_FRAMES) / FPS - 1.5) * speed_mps
    position_m = np.stack([along_m, np.zeros(_ROUTE_FRAMES), np.zeros(_ROUTE_FRAMES)], axis=1)
    route = Route(actor, position_m, np.zeros(_ROUTE_FRAMES), description)
    return make_motions((route,), (body.skeleton,), studio(), FPS, config.motion, seed)[0]


def _at(motion: BodyMotion, frames: list[int]) -> BodyMotion:
    fingers = motion.finger_from_parent
    return BodyMotion(
        motion.actor,
        motion.fps,
        motion.world_from_joint[frames],
        motion.pelvis_m[frames],
        motion.contacts[frames],
        None if fingers is None else fingers[frames],
    )


def _lined_up(body: Body, cells: list[_Cell]) -> ActorMesh:
    """All figures of a row as one actor; the row runs along Y, seen from +X."""
    placed = []
    for place, cell in enumerate(cells):
        cosine, sine = math.cos(cell.turn_rad), math.sin(cell.turn_rad)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        placed.append((cell.vertices_m - cell.axis_m) @ turn.T + [0.0, _place_m(place, len(cells)), 0.0])
    vertices_m = np.concatenate(placed).astype(np.float32)[None]
    count = len(cells[0].vertices_m)
    offsets = (count * np.arange(len(cells), dtype=np.int32))[:, None, None]
    parts = tuple(
        ActorPart(
            part.name,
            (part.faces[None] + offsets).reshape(-1, 3).astype(np.int32),
            np.tile(part.uv, (len(cells), 1, 1)),
            part.material,
        )
        for part in body.parts
    )
    return ActorMesh(0, studio().next_object_index, body.description, parts, vertices_m)


def _place_m(place: int, count: int) -> float:
    """Seen from +X, +Y is to the right."""
    return (place - 0.5 * (count - 1)) * CELL_M


def _eye_level_m(body: Body) -> float:
    return float(body.skeleton.joint_m[BODY_JOINTS.index("head"), 2])


def _row_camera(count: int) -> CameraPath:
    width_px = round(count * CELL_M * SCALE_PX_PER_M)
    middle_m = 0.5 * HEIGHT_PX / SCALE_PX_PER_M - 0.08
    return _camera(0, np.array([_FAR_AWAY_M, 0.0, middle_m + 1.5]), np.array([0.0, 0.0, middle_m]), width_px,
                   SCALE_PX_PER_M * _FAR_AWAY_M)  # fmt: skip


def _near_camera(count: int, eye_level_m: float) -> CameraPath:
    target = np.array([0.0, _place_m(0, count), eye_level_m - 0.03])
    distance_m = 2.2
    offset = distance_m * np.array([math.cos(_NEAR_TURN_RAD), -math.sin(_NEAR_TURN_RAD), 0.03])
    return _camera(1, target + offset, target, _NEAR_WIDTH_PX, HEIGHT_PX / _NEAR_M * distance_m)


def _camera(
    number: int,
    position_m: Float64[np.ndarray, "3"],
    target_m: Float64[np.ndarray, "3"],
    width_px: int,
    focal_px: float,
) -> CameraPath:
    intrinsics = Intrinsics(focal_px, focal_px, 0.5 * (width_px - 1), 0.5 * (HEIGHT_PX - 1), width_px, HEIGHT_PX)
    return CameraPath(number, look_at(position_m, target_m)[None], intrinsics)


def studio() -> Room:
    """A floor and a wall behind, in grey, under soft light from the front."""
    floor = np.array([[-3.0, -30.0, 0.0], [30.0, -30.0, 0.0], [30.0, 30.0, 0.0], [-3.0, 30.0, 0.0]])
    wall = floor[[0, 3]][[0, 1, 1, 0]] + [[0, 0, 0], [0, 0, 0], [0, 0, 12.0], [0, 0, 12.0]]
    faces = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)
    grey = Material("studio", (0.32, 0.32, 0.33), roughness=0.9)
    objs = (
        SceneObject(1, "floor", "floor", TriMesh(floor, faces), grey, True, True),
        SceneObject(2, "wall", "wall", TriMesh(wall, faces), grey, False, True),
    )
    lamp = AreaLight((9.0, -7.0, 10.0), (-0.63, 0.45, -0.63), (3.0, 3.0), 9000.0, (1.0, 0.84, 0.66))
    return Room("studio", "studio", floor[:, :2], 12.0, objs, (lamp,), None)
