"""Kimodo: what it is asked, what is made of its answer, and every way in which it can fail."""

import json
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from perpetua.errors import ActorError, AssetError
from perpetua.machine.assets import ASSET_FOLDER_VARIABLE
from perpetua.motion.config import KimodoConfig, MotionConfig
from perpetua.motion.kinematics import contact_positions, joint_index, joint_positions
from perpetua.motion.path import RoutePath
from perpetua.motion.recorded.kimodo_files import make_request, read_kimodo, read_result
from perpetua.motion.source import MOTION_SOURCES
from perpetua.scene.actor import BODY_JOINTS, BodyMotion, Route
from perpetua.seeding import StageSeed
from perpetua.testing.motion_files import install_fake_kimodo, write_amass
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton

SKELETON = sample_skeleton()
FPS = 24.0


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The stand-in for Kimodo, whose people are taller than ours and hold a phone when told."""
    skeleton, strides = sample_skeleton(1.8), {}
    for word, description in {"walk": "walks", "phone": "walks while talking on the phone"}.items():
        route = replace(sample_route("brisk", 30.0, 8.0), description=description)
        strides[word] = MOTION_SOURCES["procedural"]().make(
            route, skeleton, empty_room(), 30.0, MotionConfig(), StageSeed(5, 0, "kimodo")
        )
    return install_fake_kimodo(tmp_path_factory.mktemp("kimodo"), strides, skeleton)


@pytest.fixture(autouse=True)
def _own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ASSET_FOLDER_VARIABLE, str(tmp_path / "assets"))


@pytest.fixture(autouse=True)
def _no_calls_yet(program: Path) -> Iterator[None]:
    yield
    program.with_name("calls.txt").unlink(missing_ok=True)


def _calls(program: Path) -> int:
    log = program.with_name("calls.txt")
    return len(log.read_text(encoding="utf-8").splitlines()) if log.exists() else 0


def _route(kind: str = "curve", seconds: float = 3.0, description: str = "walks") -> Route:
    """A route that begins away from the origin and faces nowhere in particular."""
    route = sample_route(kind, FPS, seconds)
    turn = np.array([[np.cos(2.1), -np.sin(2.1), 0.0], [np.sin(2.1), np.cos(2.1), 0.0], [0.0, 0.0, 1.0]])
    place_m = route.position_m @ turn.T + np.array([3.0, -2.0, 0.0])
    return replace(route, position_m=place_m, heading_rad=route.heading_rad + 2.1, description=description)


def _make(program: Path | str, route: Route, seed: int = 1, **changes: object) -> BodyMotion:
    kimodo = KimodoConfig.model_validate({"program": str(program), **changes})
    config = MotionConfig(source="kimodo", kimodo=kimodo)
    return MOTION_SOURCES["kimodo"]().make(route, SKELETON, empty_room(), FPS, config, StageSeed(seed, 0, "motion"))


def test_the_path_begins_at_the_origin_facing_z_and_every_frame_is_given() -> None:
    # North at 1 m/s, facing north: forward is +Z; then left of it, west, is +X.
    seconds = 4.0
    time_s = np.arange(int(seconds * 24)) / 24.0
    place_m = np.stack([np.where(time_s > 2.0, 2.0 - time_s, 0.0), np.minimum(time_s, 2.0), 0 * time_s], axis=1)
    route = Route(0, place_m + 5.0, np.where(time_s > 2.0, np.pi, 0.5 * np.pi))
    request = make_request("walks", RoutePath(route, 24.0))
    (path,) = json.loads(request.constraints())
    place, heading = np.array(path["smooth_root_2d"]), np.array(path["global_root_heading"])
    count = int(np.ceil((95 / 24.0 + 1.0) * 30.0)) + 1
    assert path["type"] == "root2d" and path["frame_indices"] == list(range(count))
    assert place.shape == heading.shape == (count, 2)
    assert np.array_equal(place[0], [0.0, 0.0]) and np.array_equal(heading[0], [1.0, 0.0])
    # Half a second of lead at the same pace.
    assert np.allclose(place[45], [0.0, 1.5], atol=0.03) and np.allclose(heading[45], [1.0, 0.0], atol=1e-3)
    assert place[-1, 0] > 1.5 and abs(place[-1, 1] - 2.5) < 0.05, "a turn to the left goes towards +X"
    assert np.allclose(heading[-20], [0.0, 1.0], atol=0.05)


def test_sentences_share_the_time_and_none_lasts_longer_than_ten_seconds() -> None:
    path = RoutePath(sample_route("curve", 24.0, 24.0), 24.0)
    request = make_request("walks 2.5 m. The man looks around", path)
    assert request.prompts[0] == "A person walks 2,5 m" and request.prompts[-1] == "The man looks around"
    assert request.prompt.count(".") == len(request.prompts) == len(request.frames) == 4
    assert sum(request.frames) == len(request.place_m) and max(request.frames) < 300
    assert [int(float(word) * 30.0) for word in request.durations.split(" ")] == list(request.frames)
    assert max(float(word) for word in request.durations.split(" ")) <= 10.0
    brief = make_request("walks. waves. sits. stands", RoutePath(sample_route("curve", 24.0, 0.5), 24.0))
    assert brief.prompts == ("A person walks",)


@pytest.mark.parametrize("model", ["Kimodo-SOMA-RP-v1", "Kimodo-SMPLX-RP-v1"])
def test_the_answer_is_laid_on_the_route_with_planted_feet(program: Path, model: str) -> None:
    route = _route(description="walks while talking on the phone")
    motion = _make(program, route, model=model)
    assert motion.world_from_joint.shape == (len(route.heading_rad), 22, 3, 3)
    away_m = np.linalg.norm(motion.pelvis_m[:, :2] - route.position_m[:, :2], axis=1)
    assert away_m.max() < 0.08
    ahead = motion.world_from_joint[:, 0, :, 0]
    off_rad = np.arctan2(ahead[:, 1], ahead[:, 0]) - RoutePath(route, FPS).heading_rad(np.arange(len(ahead)) / FPS)
    assert np.abs((off_rad + np.pi) % (2.0 * np.pi) - np.pi).max() < 0.3
    contact_m = contact_positions(motion, SKELETON)
    both = motion.contacts[1:] & motion.contacts[:-1]
    assert both.mean() > 0.35
    assert np.linalg.norm(np.diff(contact_m, axis=0), axis=2)[both].max() < 1e-3
    joint_m = joint_positions(motion, SKELETON)
    left_m, right_m = (joint_m[:, joint_index(f"{side}_wrist"), 2].max() for side in ("left", "right"))
    assert right_m > 1.2 > left_m, "it is the right hand that holds the phone"


def test_a_long_route_is_made_of_several_prompts_in_one_call(program: Path) -> None:
    route = _route("slow", 12.0)
    motion = _make(program, route)
    assert np.linalg.norm((motion.pelvis_m - route.position_m)[:, :2], axis=1).max() < 0.08
    (call,) = program.with_name("calls.txt").read_text(encoding="utf-8").splitlines()
    arguments = json.loads(call)
    assert arguments[0] == "A person walks. A person walks."
    assert arguments[arguments.index("--num_transition_frames") + 1] == "5"


def test_results_are_kept_by_what_they_depend_on(program: Path, tmp_path: Path) -> None:
    route = _route()
    first, again = _make(program, route), _make(program, route)
    assert _calls(program) == 1
    assert first.world_from_joint.tobytes() == again.world_from_joint.tobytes()
    _make(program, route, seed=2)
    _make(program, route, model="Kimodo-SMPLX-RP-v1")
    _make(program, route, version="1.1")
    _make(program, replace(route, description="jumps"))
    _make(program, _route("slow"))
    assert _calls(program) == 6
    (tmp_path / "assets" / "cache" / "kimodo").mkdir(exist_ok=True)
    for kept in (tmp_path / "assets" / "cache" / "kimodo").glob("*/motion.npz"):
        kept.write_bytes(b"damaged")
    mended = _make(program, route)
    assert _calls(program) == 7 and mended.pelvis_m.tobytes() == first.pelvis_m.tobytes()


def test_many_may_ask_at_once(program: Path, tmp_path: Path) -> None:
    route = _route()
    with ThreadPoolExecutor(3) as pool:
        motions = list(pool.map(lambda _: _make(program, route), range(3)))
    assert len({motion.pelvis_m.tobytes() for motion in motions}) == 1
    names = sorted(path.name for path in (tmp_path / "assets" / "cache" / "kimodo").iterdir())
    assert len(names) == 1 and not names[0].startswith(".")


@pytest.mark.parametrize(
    ("broken", "error", "rule"),
    [
        ("exit", AssetError, "(?s)exit code 3.*CUDA out of memory"),
        ("sleep", AssetError, "longer than 0.7 s.*timeout_s"),
        ("nan", AssetError, "not finite"),
        ("short", AssetError, "frames; .* were asked for"),
        ("joints", AssetError, "78 joints"),
        ("far", ActorError, "strays .* m from its route"),
        ("keys", AssetError, "lacks .'global_rot_mats'.*version"),
        ("nothing", AssetError, "wrote neither"),
    ],
)
def test_every_failure_says_what_is_wrong(
    program: Path, monkeypatch: pytest.MonkeyPatch, broken: str, error: type[Exception], rule: str
) -> None:
    monkeypatch.setenv("FAKE_KIMODO", broken)
    with pytest.raises(error, match=rule):
        _make(program, _route(), timeout_s=0.7 if broken == "sleep" else 60.0)


def test_a_program_that_is_missing_or_of_another_version_says_so(program: Path, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="is not a program on this machine") as missing:
        _make("no_such_kimodo_gen", _route())
    assert missing.value.exit_code == 2
    old = tmp_path / "old_kimodo"
    old.write_text("#!/bin/sh\necho 'error: unrecognized arguments: --constraints' >&2; exit 2\n", encoding="utf-8")
    old.chmod(0o755)
    with pytest.raises(AssetError, match="version 1 is needed"):
        _make(old, _route())


def test_the_robot_is_refused_by_name_and_by_its_joints(program: Path, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"robot.*SOMA"):
        _make(program, _route(), model="Kimodo-G1-RP-v1")
    request = make_request("walks", RoutePath(_route(), FPS))
    frames = sum(request.frames)
    np.savez(
        tmp_path / "g1.npz",
        posed_joints=np.zeros((frames, 34, 3)),
        global_rot_mats=np.tile(np.eye(3), (frames, 34, 1, 1)),
        foot_contacts=np.zeros((frames, 4)),
    )
    with pytest.raises(AssetError, match="G1 robot"):
        read_kimodo(tmp_path / "g1.npz", request)


def test_older_files_of_thirty_joints_and_the_amass_export_tell_the_same(tmp_path: Path) -> None:
    route = sample_route("curve", 30.0, 6.0)
    source = MOTION_SOURCES["procedural"]()
    motion = source.make(route, SKELETON, empty_room(), 30.0, MotionConfig(), StageSeed(5, 0, "motion"))
    request = replace(
        make_request("walks", RoutePath(sample_route("curve", 30.0, 5.0), 30.0)),
        frames=(len(motion.pelvis_m),),
        place_m=np.tile([2.0, 1.0, 0.0], (180, 1)),
        heading_rad=np.full(180, 0.7),
    )
    y_up = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    arms, legs = [13, 16, 18, 20, 20, 20, 14, 17, 19, 21, 21, 21], [1, 4, 7, 10, 2, 5, 8, 11]
    thirty = [0, 3, 6, 9, 12, 12, 15, 15, 15, 15, *arms, *legs]
    np.savez(
        tmp_path / "old.npz",
        posed_joints=(joint_positions(motion, SKELETON) @ y_up.T)[:, thirty],
        global_rot_mats=(y_up @ motion.world_from_joint @ y_up.T)[:, thirty],
        foot_contacts=motion.contacts.astype(float),
    )
    own = read_kimodo(tmp_path / "old.npz", request)
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0.0], [np.sin(0.7), np.cos(0.7), 0.0], [0.0, 0.0, 1.0]])
    assert len(BODY_JOINTS) == 22 and np.abs(own.world_from_joint - turn @ motion.world_from_joint).max() < 1e-6
    assert np.allclose(own.pelvis, motion.pelvis_m @ turn.T + [2.0, 1.0, 0.0])
    # The export stands along Z and faces +Y.
    facing_y = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    turned = replace(motion, world_from_joint=facing_y @ motion.world_from_joint, pelvis_m=motion.pelvis_m @ facing_y.T)
    write_amass(tmp_path / "other_amass.npz", turned)
    export = read_result(tmp_path, "other", request)
    assert np.abs(export.world_from_joint - own.world_from_joint).max() < 1e-6
    shift_m = export.pelvis - own.pelvis
    assert np.abs(shift_m - shift_m[0]).max() < 1e-6 and np.linalg.norm(shift_m[0, :2]) < 0.1
