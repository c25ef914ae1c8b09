"""The stage table: what runs, in which order, from which settings. Reading it top to bottom is the pipeline.

The contact sheet is no stage: ``pipeline.room_work`` draws it of the published sequence, on which nothing depends.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from perpetua.actors.bodies.assembly import assemble_actors, draw_bodies, measured_skeletons
from perpetua.actors.bodies.source import BODY_MODELS, Body
from perpetua.actors.bodies.user_files import body_listing
from perpetua.actors.checks.validation import validate_actors
from perpetua.audit.motion_audit import MotionLimits, audit_motion
from perpetua.audit.verify import verify_sequence
from perpetua.cameras.plan import CameraPlan, plan_cameras
from perpetua.config import Config
from perpetua.config.run import RedrawConfig
from perpetua.errors import AuditError, CameraError
from perpetua.formats import layout
from perpetua.formats.tapvid_mv import write_sequence
from perpetua.io.files import read_json, write_json
from perpetua.motion.plan import make_motions
from perpetua.motion.recorded.clips import clip_listing
from perpetua.motion.source import MOTION_SOURCES
from perpetua.navigation.grid import build_nav_grid
from perpetua.navigation.types import NavGrid
from perpetua.pipeline.record import sequence_record
from perpetua.registry import Registry
from perpetua.rendering.bake import BAKE_SCRIPT
from perpetua.rendering.config import PROCESS_SETTINGS
from perpetua.rendering.render import BAKED_FOLDER, RENDER_SCRIPT, render_views
from perpetua.rooms.acceptance.build import build_room
from perpetua.rooms.files.checks import scene_digests
from perpetua.rooms.files.source import SCRIPT as SCENE_FILE_SCRIPT
from perpetua.rooms.infinigen import SCRIPT as INFINIGEN_SCRIPT
from perpetua.rooms.source import ROOM_SOURCES
from perpetua.routes.casting import action_descriptions
from perpetua.routes.plan import plan_routes
from perpetua.scene.actor import ActorMesh, BodyMotion, Route
from perpetua.scene.camera import CameraPath
from perpetua.scene.room import Room
from perpetua.scene.scene import RenderedView, Scene
from perpetua.seeding import StageSeed
from perpetua.tracks.follow import TrackScene
from perpetua.tracks.make import make_tracks
from perpetua.tracks.types import SequenceTracks

Value = TypeVar("Value")

_FRAMES = "sequence.frames"
_FPS = "sequence.fps"

# Where the export stage writes the sequence inside its folder, until it is published.
SEQUENCE_FOLDER = "sequence"
# Figures of the stages' own checks, which the audit gathers.
ACTOR_FIGURES = "validation.json"
CAMERA_FIGURES = "plan.json"
MOTION_FIGURES = "motion.json"
# Named as in older work areas, which stay readable.
VISIBILITY_FIGURES = "sight.json"
# Where Blender's job and its finished frames lie, inside the folder of the render stage.
RENDER_JOB_FOLDER = "job"


@dataclass(frozen=True)
class StageContext:
    """What a stage's function may use.

    ``folder`` takes the stage's files; ``upstream`` loads an earlier stage's value and ``folder_of`` is where its files
    lie, for stages that the row declares in ``needs``; ``shared`` holds what several stages of the room make from the
    same settings; ``on_frame`` reports rendered frames (done, total, seconds of the last one).
    """

    config: Config
    seed: StageSeed
    folder: Path
    device: str
    folder_of: Callable[[str], Path]
    upstream: Callable[[str], Any]
    shared: dict[str, Any]
    on_frame: Callable[[int, int, float], None]

    def one(self, stage: str, kind: type[Value]) -> Value:
        """The value of an earlier stage."""
        value = self.upstream(stage)
        if not isinstance(value, kind):
            raise TypeError(f"stage {stage} gave {type(value).__name__}, not {kind.__name__}")
        return value

    def many(self, stage: str, kind: type[Value]) -> tuple[Value, ...]:
        """The values of an earlier stage that makes several."""
        values = self.one(stage, tuple)
        if not all(isinstance(value, kind) for value in values):
            raise TypeError(f"stage {stage} gave something other than {kind.__name__}")
        return values


class UndeclaredInputError(Exception):
    """A stage reads what its row does not declare, so that its key would not change with it: a fault of the table."""


def _never(rejected: int, config: RedrawConfig) -> int:
    return 0


def _every_time(rejected: int, config: RedrawConfig) -> int:
    return rejected


def _when_routes_are_spent(rejected: int, config: RedrawConfig) -> int:
    return rejected // (config.routes_per_room + 1)


@dataclass(frozen=True)
class Stage:
    """One row of the table.

    ``section`` picks the settings that the key depends on; ``version`` counts changes of the code; ``scripts`` are
    the Blender scripts it starts; ``redraw`` turns the number of draws rejected so far into what its streams and
    key get of it; a ``resumable`` stage goes on from what an interrupted run left; ``leftovers``
    are names in its folder that only serve to go on, removed when it is finished.
    """

    number: int
    name: str
    version: int
    needs: tuple[str, ...]
    section: Callable[[Config], dict[str, Any]]
    run: Callable[[StageContext], object]
    scripts: tuple[Path, ...] = ()
    redraw: Callable[[int, RedrawConfig], int] = _never
    resumable: bool = False
    leftovers: tuple[str, ...] = ()


def _settings(*names: str) -> Callable[[Config], dict[str, Any]]:
    """The named settings, ``a`` for a section or ``a.b`` for a value."""

    def pick(config: Config) -> dict[str, Any]:
        picked: dict[str, Any] = {}
        settings = config.model_dump(mode="json")
        for name in names:
            value: Any = settings
            for part in name.split("."):
                value = value[part]
            picked[name] = value
        return picked

    return pick


def _plug_in_settings(*chosen: tuple[Registry[Any], str]) -> dict[str, Any]:
    """What a plug-in makes changes with its package; what comes with Perpetua counts by the stage's version."""
    packages = {registry.kind: registry.package(name) for registry, name in chosen}
    return {f"package of {kind}": package for kind, package in packages.items() if package is not None}


def _room_settings(config: Config) -> dict[str, Any]:
    """A scene file counts by its content, not by its name alone."""
    settings = {**_settings("rooms", "navigation")(config), **_plug_in_settings((ROOM_SOURCES, config.rooms.source))}
    if config.rooms.source == "file":
        settings["scenes"] = scene_digests(config.rooms.file.path)
    return settings


def _room(context: StageContext) -> Room:
    return build_room(context.config.rooms, context.config.navigation, context.seed, context.folder)


def _navigation(context: StageContext) -> NavGrid:
    return build_nav_grid(context.one("room", Room), context.config.navigation)


def _routes(context: StageContext) -> tuple[Route, ...]:
    sequence = context.config.sequence
    room, grid = context.one("room", Room), context.one("navigation", NavGrid)
    return plan_routes(room, grid, context.config.actors, sequence.frames, sequence.fps, context.seed)


def _bodies(context: StageContext) -> tuple[Body, ...]:
    """Motion and actors need the same bodies: both draw from one stream of its own, and one of them pays."""
    if "bodies" not in context.shared:
        seed = StageSeed(context.seed.seed, context.seed.room, "bodies")
        context.shared["bodies"] = draw_bodies(context.config.actors, seed)
    bodies: tuple[Body, ...] = context.shared["bodies"]
    return bodies


def _route_settings(config: Config) -> dict[str, Any]:
    """The list of actions counts by what it says, not by its name."""
    descriptions = list(action_descriptions(config.actors.motion))
    return {**_settings("actors.count", "actors.routes", _FRAMES, _FPS)(config), "descriptions": descriptions}


def _body_settings(config: Config) -> dict[str, Any]:
    """Folders of clothes and of body models count by what is in them."""
    actors = config.actors
    packages = _plug_in_settings((BODY_MODELS, actors.body), (MOTION_SOURCES, actors.motion.source))
    return {**_settings("actors", _FPS)(config), "bodies": body_listing(actors), **packages}


def _motion_settings(config: Config) -> dict[str, Any]:
    """A folder of clips counts by what is in it."""
    return {**_body_settings(config), "clips": clip_listing(config.actors.motion)}


def _motion(context: StageContext) -> tuple[BodyMotion, ...]:
    skeletons = measured_skeletons(_bodies(context))
    routes = context.many("routes", Route)
    config = context.config
    room = context.one("room", Room)
    return make_motions(routes, skeletons, room, config.sequence.fps, config.actors.motion, context.seed)


def _actors(context: StageContext) -> tuple[ActorMesh, ...]:
    bodies, motions, room = _bodies(context), context.many("motion", BodyMotion), context.one("room", Room)
    actors = assemble_actors(bodies, motions, room.next_object_index)
    report = validate_actors(
        actors,
        motions,
        tuple(body.skeleton for body in bodies),
        context.many("routes", Route),
        room,
        context.config.sequence.fps,
        context.config.actors.validation,
    )
    write_json(context.folder / ACTOR_FIGURES, report.to_json())
    return actors


def _cameras(context: StageContext) -> tuple[CameraPath, ...]:
    config = context.config
    plan = plan_cameras(
        context.one("room", Room),
        context.many("actors", ActorMesh),
        config.cameras,
        config.sequence.frames,
        config.sequence.fps,
        config.render.width_px,
        config.render.height_px,
        context.seed,
    )
    write_json(context.folder / CAMERA_FIGURES, plan.to_json())
    _require_kept_limits(context, plan)
    return plan.paths


def _require_kept_limits(context: StageContext, plan: CameraPlan) -> None:
    """Before anything is rendered, code that plans nothing measures what was planned."""
    config = context.config
    audit = audit_motion(
        context.one("room", Room),
        context.many("routes", Route),
        context.many("actors", ActorMesh),
        plan.paths,
        plan.focus,
        config.sequence.fps,
        MotionLimits(config.actors.routes, config.cameras, config.navigation),
    )
    write_json(context.folder / MOTION_FIGURES, audit.to_json())
    if not audit.passed:
        failures = "; ".join(str(check) for check in audit.checks if not check.passed)
        raise CameraError(f"the plan does not keep its limits when measured exactly: {failures}")


def _render_settings(config: Config) -> dict[str, Any]:
    """What decides the picture: not how many threads work on it, or how long they may take."""
    return config.render.model_dump(mode="json", exclude=set(PROCESS_SETTINGS))


def _render(context: StageContext) -> tuple[RenderedView, ...]:
    return render_views(
        context.one("room", Room),
        context.many("actors", ActorMesh),
        context.many("cameras", CameraPath),
        context.config.render,
        context.device,
        context.folder / RENDER_JOB_FOLDER,
        context.on_frame,
        result_dir=context.folder,
        seed=context.seed,
        # Beside the stages, so that it outlives this one and serves the room's next sequence.
        cache_dir=context.folder.parent / BAKED_FOLDER,
    )


def _scene(context: StageContext) -> Scene:
    """What was rendered, and the views."""
    return Scene(
        context.one("room", Room),
        context.many("actors", ActorMesh),
        context.many("cameras", CameraPath),
        views=context.many("render", RenderedView),
    )


def _tracks(context: StageContext) -> SequenceTracks:
    tracks = make_tracks(TrackScene(_scene(context), context.config.tracks), context.seed)
    write_json(context.folder / VISIBILITY_FIGURES, asdict(tracks.report))
    return tracks


def _export(context: StageContext) -> None:
    scene = replace(_scene(context), motions=context.many("motion", BodyMotion))
    config = context.config
    record = sequence_record(config, context.seed, scene, context.many("routes", Route))
    tracks = context.one("tracks", SequenceTracks)
    write_sequence(context.folder / SEQUENCE_FOLDER, scene, tracks, record, config.export.outputs)


def _audit(context: StageContext) -> None:
    report = verify_sequence(context.folder_of("export") / SEQUENCE_FOLDER, context.config.audit)
    figures = {
        "sequence": report.to_json(),
        "actors": read_json(context.folder_of("actors") / ACTOR_FIGURES),
        "cameras": read_json(context.folder_of("cameras") / CAMERA_FIGURES),
        "motion": read_json(context.folder_of("cameras") / MOTION_FIGURES),
        "visibility": read_json(context.folder_of("tracks") / VISIBILITY_FIGURES),
    }
    write_json(context.folder / layout.AUDIT, figures)
    if not report.passed:
        failures = "; ".join(str(check) for check in report.checks if not check.passed)
        raise AuditError(f"the finished sequence does not pass its audit: {failures}")


STAGES = (
    Stage(
        10,
        "room",
        3,
        (),
        _room_settings,
        _room,
        scripts=(INFINIGEN_SCRIPT, SCENE_FILE_SCRIPT),
        redraw=_when_routes_are_spent,
    ),
    Stage(20, "navigation", 2, ("room",), _settings("navigation"), _navigation),
    Stage(
        30,
        "routes",
        5,
        ("room", "navigation"),
        _route_settings,
        _routes,
        redraw=_every_time,
    ),
    Stage(40, "motion", 4, ("room", "routes"), _motion_settings, _motion),
    Stage(50, "actors", 3, ("room", "routes", "motion"), _body_settings, _actors),
    Stage(
        60,
        "cameras",
        4,
        ("room", "routes", "actors"),
        _settings("cameras", "actors.routes", "navigation", _FRAMES, _FPS, "render.width_px", "render.height_px"),
        _cameras,
    ),
    Stage(
        70,
        "render",
        1,
        ("room", "actors", "cameras"),
        _render_settings,
        _render,
        scripts=(BAKE_SCRIPT, RENDER_SCRIPT),
        resumable=True,
        leftovers=(RENDER_JOB_FOLDER,),
    ),
    Stage(80, "tracks", 4, ("room", "actors", "cameras", "render"), _settings("tracks"), _tracks),
    Stage(
        90,
        "export",
        3,
        ("room", "routes", "motion", "actors", "cameras", "render", "tracks"),
        Config.content,
        _export,
    ),
    Stage(95, "audit", 5, ("actors", "cameras", "tracks", "export"), _settings("audit"), _audit),
)
STAGE_NAMES = tuple(stage.name for stage in STAGES)
