"""Recorded clips: files read exactly, laid along routes with planted feet, hostile files refused."""

import io
import pickle
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from jaxtyping import Float64
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from perpetua.errors import AssetError
from perpetua.motion.config import ClipsConfig, MotionConfig
from perpetua.motion.kinematics import contact_positions
from perpetua.motion.legs import foot_of
from perpetua.motion.recorded import archive
from perpetua.motion.recorded.amass import read_amass
from perpetua.motion.recorded.bvh import read_bvh_clip
from perpetua.motion.recorded.clips import clip_listing
from perpetua.motion.recorded.foot_planting import WantedFoot, plant_foot
from perpetua.motion.recorded.library import action_words, clip_files, ranked_clips
from perpetua.motion.rotations import about_y, about_z
from perpetua.motion.source import MOTION_SOURCES
from perpetua.scene.actor import BODY_JOINTS, BodyMotion, Route
from perpetua.seeding import StageSeed
from perpetua.testing.motion_files import Y_UP_FROM_OURS, mixamo_name, write_amass, write_bvh
from perpetua.testing.motion_samples import empty_room, sample_route, sample_skeleton

# Legs of SMPL-X's mean length, so that files without lengths are of our size.
SKELETON = sample_skeleton(1.7 * 0.81 / 0.8252)
ROOM = empty_room()
FPS = 30.0
LEGS = [index for index, name in enumerate(BODY_JOINTS) if name.endswith(("hip", "knee", "ankle", "foot"))]
UPPER = [index for index in range(22) if index not in LEGS]


@cache
def _walk(kind: str, seconds: float, description: str = "walks") -> tuple[Route, BodyMotion]:
    route = replace(sample_route(kind, FPS, seconds), description=description)
    source = MOTION_SOURCES["procedural"]()
    return route, source.make(route, SKELETON, ROOM, FPS, MotionConfig(), StageSeed(3, 1, "motion"))


def _make(route: Route, folder: Path, seed: int = 4, from_start: bool = False) -> BodyMotion:
    config = MotionConfig(source="clips", clips=ClipsConfig(folder=str(folder), from_start=from_start))
    return MOTION_SOURCES["clips"]().make(route, SKELETON, ROOM, FPS, config, StageSeed(seed, 0, "motion"))


def _apart_deg(
    first: Float64[np.ndarray, "T J 3 3"], second: Float64[np.ndarray, "T J 3 3"]
) -> Float64[np.ndarray, "T J"]:
    trace = np.trace(np.swapaxes(first, 2, 3) @ second, axis1=2, axis2=3)
    return np.rad2deg(np.arccos(np.clip(0.5 * (trace - 1.0), -1.0, 1.0)))


def _check_locked(motion: BodyMotion, joint_rps: float = 16.0) -> None:
    contact_m = contact_positions(motion, SKELETON)
    both = motion.contacts[1:] & motion.contacts[:-1]
    assert both.mean() > 0.3
    assert np.linalg.norm(np.diff(contact_m, axis=0), axis=2)[both].max() < 1e-3
    assert np.abs(contact_m[..., 2][motion.contacts]).max() < 2e-3
    assert contact_m[..., 2].min() > -5e-3
    turn_deg = _apart_deg(motion.world_from_joint[:-1], motion.world_from_joint[1:])
    assert np.deg2rad(turn_deg.max()) * motion.fps < joint_rps


@pytest.mark.parametrize(("up", "keys"), [("z", "smplx"), ("y", "smplx"), ("z", "smplh"), ("y", "poses")])
def test_an_amass_file_holds_what_was_written(tmp_path: Path, up: str, keys: str) -> None:
    # One hand up: a mirrored body would show.
    _, motion = _walk("curve", 3.0, "walks while waving the right hand")
    write_amass(tmp_path / "clip.npz", motion, up, keys)
    clip = read_amass(tmp_path / "clip.npz")
    assert clip.fps == FPS
    assert np.abs(clip.world_from_joint - motion.world_from_joint).max() < 1e-6
    shift_m = clip.pelvis - motion.pelvis_m
    assert np.abs(shift_m - shift_m[0]).max() < 1e-6
    assert clip.finger_from_parent is not None
    first = Rotation.from_rotvec(np.linspace(0.0, 0.3, 90)[:3] @ Y_UP_FROM_OURS).as_matrix()
    assert np.allclose(clip.finger_from_parent[:, 0], first)


def test_a_bvh_file_holds_what_was_written(tmp_path: Path) -> None:
    _, motion = _walk("curve", 3.0, "walks while waving the right hand")
    write_bvh(tmp_path / "clip.bvh", motion, SKELETON)
    clip = read_bvh_clip(tmp_path / "clip.bvh")
    assert clip.fps == pytest.approx(FPS, abs=1e-4)
    assert _apart_deg(clip.world_from_joint, motion.world_from_joint).max() < 0.01
    assert np.abs(clip.pelvis - 100.0 * motion.pelvis_m).max() < 1e-3
    assert clip.leg == pytest.approx(81.0, abs=0.2)


def _zero_pose_along_one_axis() -> Float64[np.ndarray, "22 3 3"]:
    """LaFAN1's way: with all rotations zero every bone lies along +X of the file, the body's left along +Z."""
    upright = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    turns = {"hip": 180.0, "knee": 180.0, "ankle": 180.0 + 70.0, "foot": 180.0 + 70.0}
    zero = np.empty((22, 3, 3))
    for joint, name in enumerate(BODY_JOINTS):
        side, _, part = name.partition("_")
        # Legs are turned about the body's left, +X of the T-pose; arms about its front, +Z.
        if part in turns:
            own = Rotation.from_euler("x", -turns[part] if part in ("ankle", "foot") else turns[part], degrees=True)
        elif part in ("collar", "shoulder", "elbow", "wrist"):
            own = Rotation.from_euler("z", 90.0 if side == "left" else -90.0, degrees=True)
        else:
            own = Rotation.identity()
        zero[joint] = upright @ own.as_matrix()
    return zero


def test_a_bvh_file_whose_zero_pose_is_no_t_pose_gives_the_same_limbs(tmp_path: Path) -> None:
    _, motion = _walk("curve", 2.0, "walks while waving the right hand")
    write_bvh(tmp_path / "clip.bvh", motion, SKELETON, _zero_pose_along_one_axis())
    clip = read_bvh_clip(tmp_path / "clip.bvh")
    apart_deg = _apart_deg(clip.world_from_joint, motion.world_from_joint).max(axis=0)
    for name, worst_deg in zip(BODY_JOINTS, apart_deg, strict=True):
        # Where collar bones and feet point in a T-pose differs from body to body.
        assert worst_deg < (18.0 if name.endswith(("collar", "ankle", "foot")) else 5.0), name


@pytest.mark.parametrize(("kind", "form"), [("slow", "npz"), ("curve", "npz"), ("brisk", "bvh")])
def test_a_clip_along_its_own_path_stays_what_it_was(tmp_path: Path, kind: str, form: str) -> None:
    route, motion = _walk(kind, 4.0)
    if form == "npz":
        write_amass(tmp_path / "walk.npz", motion, "y")
    else:
        write_bvh(tmp_path / "walk.bvh", motion, SKELETON)
    again = _make(route, tmp_path, from_start=True)
    apart_deg = _apart_deg(again.world_from_joint, motion.world_from_joint)
    assert np.median(apart_deg[:, UPPER]) < 2.0 and np.percentile(apart_deg[:, UPPER], 95) < 9.0
    assert np.median(apart_deg[:, LEGS]) < 5.0 and np.percentile(apart_deg[:, LEGS], 95) < 18.0
    assert np.linalg.norm(again.pelvis_m - motion.pelvis_m, axis=1).max() < 0.06
    assert (again.contacts == motion.contacts).mean() > 0.88


def test_a_short_recording_of_another_body_loops_along_a_bent_route(tmp_path: Path) -> None:
    _, motion = _walk("brisk", 3.0)
    rng = np.random.default_rng(0)
    frames = len(motion.pelvis_m)
    shakes = gaussian_filter1d(rng.standard_normal((frames, 22 * 3)), 2.0, axis=0) * np.deg2rad(3.0)
    shaky = Rotation.from_rotvec(shakes.reshape(-1, 3)).as_matrix()
    small = replace(
        motion,
        world_from_joint=motion.world_from_joint @ shaky.reshape(frames, 22, 3, 3),
        pelvis_m=0.8 * motion.pelvis_m,
    )
    write_bvh(tmp_path / "walk.bvh", small, sample_skeleton(0.8 * 1.7 * 0.81 / 0.8252))
    route = sample_route("random", FPS, 9.0)
    walked = _make(route, tmp_path)
    _check_locked(walked, joint_rps=24.0)
    assert np.linalg.norm((walked.pelvis_m - route.position_m)[:, :2], axis=1).max() < 0.12


def test_a_pause_puts_the_feet_beside_each_other_and_keeps_them_there(tmp_path: Path) -> None:
    _, motion = _walk("curve", 6.0)
    write_amass(tmp_path / "walk.npz", motion)
    route = sample_route("straight", FPS, 9.0)
    walked = _make(route, tmp_path)
    _check_locked(walked)
    assert walked.contacts[-3:].all(), "both feet stand at the end"
    ankle_m = contact_positions(walked, SKELETON)[-1, [0, 2]]
    assert abs(ankle_m[0, 0] - ankle_m[1, 0]) < 0.15 and 0.1 < ankle_m[0, 1] - ankle_m[1, 1] < 0.4
    turn_deg = _apart_deg(walked.world_from_joint[-4:-1], walked.world_from_joint[-3:])
    assert turn_deg.max() < 1.5


def test_a_running_foot_beyond_the_vertical_keeps_its_yaw_and_stands_still() -> None:
    weight = np.clip((np.arange(90.0) - 20.0) / 50.0, 0.0, 1.0)
    pitch_rad = 2.0 * np.sin(np.pi * weight) ** 2
    rotation = about_z(np.full(90, 0.4)) @ about_y(pitch_rad)
    ankle_m = np.column_stack([2.0 * weight, np.zeros(90), 0.08 + 0.3 * np.sin(np.pi * weight) ** 2])
    stands = (weight == 0.0) | (weight == 1.0)
    shape = foot_of(SKELETON, "left")
    track = plant_foot(WantedFoot(ankle_m, rotation, rotation, stands, np.ones(90)), shape, np.full(90, 0.25))
    assert np.allclose(track.yaw_rad, 0.4) and track.pitch_rad.max() > 1.95
    for contact, where in ((track.heel_contact, stands), (track.toe_contact, stands)):
        assert np.array_equal(contact, where)
    assert np.ptp(track.ankle_m[:20], axis=0).max() < 1e-9
    assert np.allclose(track.ankle_m[stands, 2], 0.25 + shape.ankle_height_m)
    assert np.abs(np.diff(track.ankle_m, axis=0)).max() < 0.08


@pytest.mark.parametrize(("wanted", "found"), [("talks on the phone", "walk_phone.npz"), ("dances", "b2.npz")])
def test_words_choose_the_clip(tmp_path: Path, wanted: str, found: str) -> None:
    for name in ("walk_01.npz", "walk_phone.npz", "b2.npz"):
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "index.yaml").write_text("b2.npz: [dancing, twirls]\nwalk_01.npz: walks\n", encoding="utf-8")
    for seed in range(3):
        assert ranked_clips(clip_files(tmp_path), wanted, np.random.default_rng(seed))[0][0].name == found
    drawn = {ranked_clips(clip_files(tmp_path), "swims", np.random.default_rng(seed))[0][0].name for seed in range(30)}
    assert len(drawn) == 3, "without a matching word the seed decides"


@pytest.mark.parametrize("kind", ["slow", "brisk"])
def test_of_clips_that_fit_alike_the_one_of_the_route_s_pace_is_played(tmp_path: Path, kind: str) -> None:
    both, only = tmp_path / "both", tmp_path / "only"
    for folder, kinds in ((both, ("slow", "brisk")), (only, (kind,))):
        folder.mkdir()
        for name in kinds:
            write_amass(folder / f"walk_{name}.npz", _walk(name, 4.0)[1])
    route = sample_route(kind, FPS, 3.0)
    for seed in range(2):
        assert _make(route, both, seed).pelvis_m.tobytes() == _make(route, only, seed).pelvis_m.tobytes()


def test_words_are_compared_by_their_stems() -> None:
    assert action_words("WalkingSlowly_01") == {"walk", "slow"}
    assert action_words("a person waves with her hand") == {"wav", "hand"}


@pytest.mark.parametrize(
    ("content", "rule"),
    [("- walk", "must map"), ("nobody.npz: walks", "not a clip"), ("walk.npz: 3", "description"), ("a: [", "cannot")],
)
def test_an_index_that_is_not_valid_says_so(tmp_path: Path, content: str, rule: str) -> None:
    (tmp_path / "walk.npz").write_bytes(b"")
    (tmp_path / "index.yaml").write_text(content, encoding="utf-8")
    with pytest.raises(AssetError, match=rule):
        clip_files(tmp_path)


def test_a_folder_without_clips_and_a_clip_that_only_stands_say_so(tmp_path: Path) -> None:
    route, standing = _walk("stand", 3.0)
    with pytest.raises(AssetError, match="is no folder") as missing:
        _make(route, tmp_path / "nowhere")
    assert missing.value.exit_code == 2
    with pytest.raises(AssetError, match="holds no clips"):
        _make(route, tmp_path)
    write_amass(tmp_path / "stand.npz", standing)
    _check_locked(_make(route, tmp_path))
    with pytest.raises(AssetError, match="add a clip of somebody walking"):
        _make(sample_route("curve", FPS), tmp_path)


def test_a_changed_folder_is_other_input_of_the_motion_stage(tmp_path: Path) -> None:
    config = MotionConfig(source="clips", clips=ClipsConfig(folder=str(tmp_path)))
    listings = [clip_listing(config)]
    (tmp_path / "walk.npz").write_bytes(b"1")
    listings.append(clip_listing(config))
    (tmp_path / "walk.npz").write_bytes(b"22")
    listings.append(clip_listing(config))
    assert [len(listing) for listing in listings] == [0, 1, 1] and listings[1] != listings[2]
    assert clip_listing(MotionConfig()) == []


class _Trap:
    """Would write a file if anything unpickled it."""

    def __reduce__(self) -> tuple[Callable[..., object], tuple[str, ...]]:
        return (print, ("unpickled",))


def _arrays() -> dict[str, np.ndarray]:
    return {
        "trans": np.zeros((20, 3)),
        "root_orient": np.zeros((20, 3)),
        "pose_body": np.zeros((20, 63)),
        "mocap_frame_rate": np.array(30.0),
    }


@pytest.mark.parametrize(
    ("changes", "rule"),
    [
        ({"trans": np.full((20, 3), np.nan)}, "not finite"),
        ({"poses": np.zeros((0, 156))}, "0 frames"),
        ({"pose_body": np.full((20, 63), np.inf)}, "not finite"),
        ({"trans": np.zeros((19, 3))}, "19 rows of trans"),
        ({"trans": np.zeros((20, 4))}, r"\(T, 3\) is needed"),
        ({"pose_body": np.zeros((20, 60))}, r"\(T, 63\) is needed"),
        ({"poses": np.zeros((20, 100))}, "a row must hold"),
        ({"poses": np.zeros(20)}, "a row must hold"),
        ({"mocap_frame_rate": np.array("fast")}, "lacks a frame rate"),
        ({"mocap_frame_rate": np.array(0.0)}, "frames per second"),
        ({name: value[:3] for name, value in _arrays().items() if value.ndim == 2}, "3 frames"),
        ({"trans": np.array([_Trap()], dtype=object)}, "not a plain array"),
        ({"pose_body": np.array(["a"] * 20)}, "is needed"),
    ],
)
def test_files_that_cannot_be_motion_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], changes: dict[str, np.ndarray], rule: str
) -> None:
    np.savez(tmp_path / "clip.npz", **{**_arrays(), **changes})
    with pytest.raises(AssetError, match=rule):
        read_amass(tmp_path / "clip.npz")
    assert "unpickled" not in capsys.readouterr().out


def test_a_missing_key_and_a_damaged_file_are_refused(tmp_path: Path) -> None:
    arrays = _arrays()
    del arrays["trans"]
    np.savez(tmp_path / "clip.npz", **arrays)
    with pytest.raises(AssetError, match="lacks 'trans'"):
        read_amass(tmp_path / "clip.npz")
    for content in (b"", b"PK\x03\x04nonsense", pickle.dumps(_Trap()), (tmp_path / "clip.npz").read_bytes()[:300]):
        (tmp_path / "bad.npz").write_bytes(content)
        with pytest.raises(AssetError, match="cannot read"):
            read_amass(tmp_path / "bad.npz")


def test_a_file_that_unpacks_to_too_much_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archive, "MOST_BYTES", 100_000)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "<f8", "fortran_order": False, "shape": (10**9, 3)})
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as bomb:
        bomb.writestr("trans.npy", header.getvalue() + bytes(10**6))
    with pytest.raises(AssetError, match="unpacks to"):
        read_amass(tmp_path / "bomb.npz")
    with zipfile.ZipFile(tmp_path / "lie.npz", "w", zipfile.ZIP_DEFLATED) as lie:
        lie.writestr("trans.npy", header.getvalue() + bytes(1000))
    with pytest.raises(AssetError, match="does not fit"):
        read_amass(tmp_path / "lie.npz")


@pytest.mark.parametrize(
    ("old", "new", "rule"),
    [
        ("MOTION", "NOTION", "no MOTION section"),
        ("HIERARCHY", "HIERARCHIE", "HIERARCHY is expected"),
        ("OFFSET", "OFFSET x", "a number is expected"),
        ("Zrotation", "Wrotation", "channels among"),
        ("Frame Time: 0.03", "Frame Time: -0.03", "frame time"),
        ("Frames: 60", "Frames: 61", "numbers, not"),
        ("Frames: 60", "Frames: 0", "0 frames"),
        ("End Site", "Ende", "JOINT, End Site"),
        (mixamo_name("left_knee"), "Knie", "lacks the joints.*leftleg"),
    ],
)
def test_bvh_files_that_break_a_rule_say_which(tmp_path: Path, old: str, new: str, rule: str) -> None:
    _, motion = _walk("curve", 2.0)
    write_bvh(tmp_path / "clip.bvh", motion, SKELETON)
    text = (tmp_path / "clip.bvh").read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "clip.bvh").write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(AssetError, match=rule) as refused:
        read_bvh_clip(tmp_path / "clip.bvh")
    assert refused.value.exit_code == 2


def test_a_bvh_file_that_ends_early_says_so(tmp_path: Path) -> None:
    (tmp_path / "clip.bvh").write_text("HIERARCHY ROOT Hips { OFFSET 0 0 0 MOTION", encoding="utf-8")
    with pytest.raises(AssetError, match="the end of the hierarchy"):
        read_bvh_clip(tmp_path / "clip.bvh")
