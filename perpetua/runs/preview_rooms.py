"""A page of rooms, each from above and from two corners, to be looked at before anything is rendered of them."""

import base64
import io
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from perpetua.config import Config
from perpetua.errors import PerpetuaError
from perpetua.io.files import read_json, write_json
from perpetua.io.html_page import html_environment, write_html
from perpetua.machine.scripts import scripts_sha256
from perpetua.machine.system_libraries import require_libraries
from perpetua.navigation.types import NavGrid
from perpetua.pipeline import codec
from perpetua.pipeline.layout import RoomLayout, open_run, sequence_name
from perpetua.pipeline.runner import RoomRun
from perpetua.pipeline.stages import STAGES
from perpetua.pipeline.store import key_of
from perpetua.rendering.bake import BAKE_SCRIPT
from perpetua.rendering.config import RenderConfig
from perpetua.rendering.job import RENDER_SCRIPT
from perpetua.rendering.render import render_views
from perpetua.report.pictures.room_views import HEIGHT_PX, TOP, WIDTH_PX, place_views
from perpetua.rooms.acceptance.build import REPORT_FILE, check_source
from perpetua.scene.room import Room
from perpetua.scene.scene import RenderedView

# Enough to judge a room by, and little work: few samples, few bounces, and materials baked coarsely.
PICTURES = {"samples": 12, "max_bounces": 3, "noise_threshold": 0.1, "bake": True, "max_texels": 200_000}
# What is in no room, in the view from above.
PAPER = (238, 236, 231)
VIEW_NAMES = ("above", "corner_1", "corner_2")
LAST_STAGE = "navigation"
# Raised when the views or their settings change, so that old pictures are drawn again.
DRAWING_VERSION = 1


@dataclass(frozen=True)
class GalleryRequest:
    """Which rooms are shown, and where the page goes."""

    config: Config
    seed: int
    rooms: range
    out: Path
    device: str


@dataclass(frozen=True)
class RoomCard:
    """What the page says of a room; ``failure`` says why there is none."""

    title: str
    facts: str
    failure: str | None = None


def write_room_gallery(request: GalleryRequest, say: Callable[[str], None]) -> int:
    """Makes the rooms that are not in ``request.out`` yet, draws them, and writes ``index.html`` after each.

    Returns:
        How many rooms could not be made.

    Raises:
        InputError: the config asks for what the room source cannot make, or the folder holds another run.
    """
    require_libraries()
    check_source(request.config.rooms)
    run = open_run(request.out, request.seed, request.rooms, request.config, replace=False)
    pictures = request.out / "pictures"
    pictures.mkdir(exist_ok=True)
    cards: list[tuple[int, RoomCard]] = []
    for index in request.rooms:
        try:
            card = _card_of(request, run.layout(request.out).room(index), pictures, say)
        except PerpetuaError as error:
            card = RoomCard(f"room {index}", "", failure=str(error))
        say(f"{card.title}: {card.facts}" if card.failure is None else f"{card.title} failed: {card.failure}")
        cards.append((index, card))
        _write_page(request, cards, pictures)
    return sum(card.failure is not None for _, card in cards)


def _card_of(request: GalleryRequest, layout: RoomLayout, pictures: Path, say: Callable[[str], None]) -> RoomCard:
    index = layout.number
    run = RoomRun(request.config, request.seed, index, request.out, request.device, lambda event: None)
    run.run(LAST_STAGE, even_if_published=True)
    folders = {stage.name: layout.stage(stage).final for stage in STAGES}
    scripts = scripts_sha256((BAKE_SCRIPT, RENDER_SCRIPT))
    key = key_of({"room": run.keys[LAST_STAGE], "scripts": scripts, "drawing": DRAWING_VERSION})
    stem = pictures / layout.name
    record = stem.with_suffix(".json")
    stored = read_json(record)
    if stored.get("key") == key and all(_picture(stem, name).is_file() for name in VIEW_NAMES):
        return RoomCard(**stored["card"])
    say(f"room {index}: drawing")
    room, grid = codec.load(folders["room"]), codec.load(folders["navigation"])
    scratch = layout.work_folder / "gallery"
    try:
        draw_room(room, stem, request.config.render, request.device, scratch)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    light = "light as in the file" if request.config.rooms.source == "file" else _light(folders["room"])
    card = describe_room(f"room {index}: {room.kind}", room, grid, light)
    write_json(record, {"key": key, "card": asdict(card)})
    return card


def _light(room_folder: Path) -> str:
    """Time of day and lamps, from the report beside the room."""
    wish = read_json(room_folder / REPORT_FILE)["wish"]
    return f"{wish['daytime']}, lamps {'on' if wish['lamps_on'] else 'off'}"


def describe_room(title: str, room: Room, grid: NavGrid, light: str) -> RoomCard:
    """The figures of a room; ``light`` says what lights it."""
    x_m, y_m = np.ptp(room.floor_polygon_m, axis=0)
    triangles = sum(len(obj.mesh.faces) for obj in room.objects)
    facts = [
        f"{x_m:.1f} x {y_m:.1f} x {room.height_m:.1f} m",
        f"{len(room.objects)} objects",
        f"{triangles:,} triangles",
        f"{grid.free_floor_m2:.1f} m² free floor",
        light,
    ]
    return RoomCard(title, " · ".join(facts))


def draw_room(room: Room, stem: Path, render: RenderConfig, device: str, scratch: Path) -> tuple[Path, ...]:
    """Draws a room from above, without what is near the ceiling, and from two corners.

    Args:
        room: any room.
        stem: files get this path with ``_above.jpg``, ``_corner_1.jpg`` and ``_corner_2.jpg`` behind it.
        render: the render section of the config; size, samples and baking are the gallery's own.
        device: what Cycles renders on.
        scratch: folder for Blender's job; left to the caller to remove.

    Raises:
        RenderError: Blender failed.
    """
    views = place_views(room)
    config = render.model_copy(update={"width_px": WIDTH_PX, "height_px": HEIGHT_PX, **PICTURES})
    rendered = render_views(
        room, (), views.cameras, config, device, scratch, lambda *progress: None, near_m={TOP: views.top_near_m}
    )
    paths = []
    for name, view in zip(VIEW_NAMES, rendered, strict=True):
        rgb = _on_paper(view) if name == VIEW_NAMES[TOP] else _rgb(view)
        path = _picture(stem, name)
        Image.fromarray(rgb).save(path, quality=90)
        paths.append(path)
    return tuple(paths)


def _picture(stem: Path, view: str) -> Path:
    return stem.with_name(f"{stem.name}_{view}.jpg")


def _rgb(view: RenderedView) -> UInt8[np.ndarray, "H W 3"]:
    return np.array(Image.open(io.BytesIO(view.jpeg[0])).convert("RGB"))


def _on_paper(view: RenderedView) -> UInt8[np.ndarray, "H W 3"]:
    rgb = _rgb(view)
    rgb[np.asarray(view.object_index[0]) == 0] = PAPER
    return rgb


def _write_page(request: GalleryRequest, cards: list[tuple[int, RoomCard]], pictures: Path) -> None:
    source = request.config.rooms.source
    rooms = []
    for index, card in cards:
        stem = pictures / sequence_name(request.seed, index)
        names = VIEW_NAMES if card.failure is None else ()
        shown = [
            {"name": name, "content": base64.b64encode(_picture(stem, name).read_bytes()).decode()} for name in names
        ]
        rooms.append({"card": card, "pictures": shown})
    title = f"{len(cards)} of {len(request.rooms)} rooms of seed {request.seed}, source {source}"
    environment = html_environment(Path(__file__).parent)
    write_html(environment, "rooms.html.j2", request.out / "index.html", title=title, rooms=rooms)
