"""Labels of every pixel against the synthetic scene, whose meshes and cameras are known exactly."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from perpetua.config import load_config
from perpetua.errors import ConfigError
from perpetua.formats.config import OUTPUTS
from perpetua.formats.frame_file import FrameFile
from perpetua.formats.label_files import write_labels
from perpetua.formats.poses import object_poses, resting_pose
from perpetua.labels import pixels
from perpetua.scene.scene import Scene
from perpetua.testing.synthetic_scene import make_scene
from perpetua.testing.synthetic_sequence import write_scene

SHELL, ACTORS = 1, (5, 6)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("labels") / "sequence"
    write_scene(folder, OUTPUTS)
    return folder


@pytest.fixture(scope="module")
def scene() -> Scene:
    return make_scene()


def _views(scene: Scene, folder: Path) -> list[Path]:
    for view in range(len(scene.views)):
        (folder / str(view)).mkdir(parents=True)
    return [folder / str(view) for view in range(len(scene.views))]


def _world_m(scene: Scene, view: int, frame: int) -> np.ndarray:
    """What the rendered depth shows, in the world."""
    camera, inner = scene.cameras[view], scene.cameras[view].intrinsics
    depth = scene.views[view].depth_m[frame].astype(np.float64)
    row, column = np.mgrid[: inner.height_px, : inner.width_px]
    local = np.stack(
        [(column - inner.cx_px) / inner.fx_px * depth, (row - inner.cy_px) / inner.fy_px * depth, depth], axis=2
    )
    pose = camera.world_from_camera[frame]
    return np.asarray(local @ pose[:3, :3].T + pose[:3, 3])


def _pixel(scene: Scene, view: int, frame: int, world_m: np.ndarray) -> np.ndarray:
    inner, pose = scene.cameras[view].intrinsics, scene.cameras[view].world_from_camera[frame]
    local = (world_m - pose[:3, 3]) @ pose[:3, :3]
    return np.stack(
        [
            inner.fx_px * local[..., 0] / local[..., 2] + inner.cx_px,
            inner.fy_px * local[..., 1] / local[..., 2] + inner.cy_px,
            local[..., 2],
        ],
        axis=-1,
    )


def test_object_index_is_the_rendered_one(folder: Path, scene: Scene) -> None:
    for view, rendered in enumerate(scene.views):
        np.testing.assert_array_equal(np.load(folder / f"{view}/object_index.npy"), rendered.object_index)


def test_normals_of_the_room_are_those_of_its_six_planes(folder: Path, scene: Scene) -> None:
    for view, camera in enumerate(scene.cameras):
        normal = np.load(folder / f"{view}/normals.npy").astype(np.float64)
        for frame in (0, 5):
            world_m = _world_m(scene, view, frame)
            in_world = normal[frame] @ camera.world_from_camera[frame][:3, :3].T
            shell = scene.views[view].object_index[frame] == SHELL
            high, low = np.array([3.0, 2.5, 2.8]), np.array([-3.0, -2.5, 0.0])
            off_m = np.concatenate([np.abs(world_m - high), np.abs(world_m - low)], axis=2)
            inwards = np.concatenate([-np.eye(3), np.eye(3)])[off_m.argmin(axis=2)]
            np.testing.assert_allclose(in_world[shell], inwards[shell], atol=1e-6)


def test_scene_flow_is_nothing_on_objects_and_stays_on_the_bodies(folder: Path, scene: Scene) -> None:
    for view in range(len(scene.views)):
        moved_m = np.load(folder / f"{view}/scene_flow.npy")
        for frame in (0, 4):
            shown = scene.views[view].object_index[frame]
            assert (moved_m[frame][~np.isin(shown, ACTORS)] == 0.0).all()
            world_m = _world_m(scene, view, frame)
            for actor in scene.actors:
                chosen = shown == actor.object_index
                if not chosen.any():
                    continue
                there_m = world_m[chosen] + moved_m[frame][chosen]
                assert np.linalg.norm(moved_m[frame][chosen], axis=1).min() > 0.02
                body = trimesh.Trimesh(actor.vertices_m[frame + 1].astype(np.float64), actor.faces, process=False)
                _, off_m, _ = trimesh.proximity.closest_point_naive(body, there_m[:40])
                assert off_m.max() < 1e-5


def test_flow_leads_to_where_depth_and_cameras_say(folder: Path, scene: Scene) -> None:
    """Between frames with scene flow added, and between views: to the pixel, seen, hidden or off the image."""
    for view in range(len(scene.views)):
        ways = [
            (f"{view}/flow_to_{other}", frame, other, frame, 0.0)
            for other in range(len(scene.views)) if other != view for frame in (1, 4)
        ]  # fmt: skip
        moved_m = np.load(folder / f"{view}/scene_flow.npy")
        ways += [(f"{view}/flow", frame, view, frame + 1, moved_m[frame]) for frame in (0, 4)]
        for name, frame, other, other_frame, moves_m in ways:
            flow, state = np.load(folder / f"{name}.npy")[frame], np.load(folder / f"{name}_state.npy")[frame]
            expected = _pixel(scene, other, other_frame, _world_m(scene, view, frame) + moves_m)
            row, column = np.mgrid[: flow.shape[0], : flow.shape[1]]
            end_px = flow + np.stack([column, row], axis=2)
            ahead = expected[..., 2] > 0.05
            np.testing.assert_allclose(end_px[ahead], expected[ahead][:, :2], rtol=1e-3, atol=5e-3)
            np.testing.assert_array_equal(state == 0, expected[..., 2] <= 0.0)
            inside = (np.abs(end_px - [47.5, 35.5]) < [48.0, 36.0]).all(axis=2)
            np.testing.assert_array_equal(np.isin(state, (1, 2)), inside & (expected[..., 2] > 0.0))
            first = np.floor(end_px[inside]).astype(int)
            corners = (first[:, None] + [[0, 0], [1, 0], [0, 1], [1, 1]]).clip(0, [95, 71])
            shown_m = scene.views[other].depth_m[other_frame][corners[..., 1], corners[..., 0]]
            at_m = expected[inside][:, 2:]
            hidden = (at_m > shown_m + 0.1).all(axis=1)
            level = (np.abs(at_m - shown_m) < 0.02).all(axis=1)
            assert hidden.any() and (state[inside][hidden] == 2).mean() > 0.97
            assert (state[inside][level] == 1).mean() > 0.97


def test_labels_do_not_depend_on_what_is_cast_at_a_time(
    folder: Path, scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(pixels, "BLOCK_PIXELS", 1000)
    _views(scene, tmp_path)
    report = write_labels(tmp_path, scene, OUTPUTS)
    assert report.shown == report.labelled == 3 * 6 * 72 * 96
    written = [path.relative_to(tmp_path) for path in tmp_path.rglob("*.npy")]
    assert len(written) == 3 * (1 + 1 + 1 + 2 + 4)
    for path in written:
        assert (tmp_path / path).read_bytes() == (folder / path).read_bytes(), path


def test_pixels_that_show_something_else_have_no_label(scene: Scene, tmp_path: Path) -> None:
    """The image has the last word: another object there, or the same one at another depth."""
    index, depth_m = scene.views[1].object_index.copy(), scene.views[1].depth_m.copy()
    index[2, 10, 20], depth_m[3, 30] = 6, depth_m[3, 30] + 0.01
    index[4, 0, :7], depth_m[4, 0, :7] = 0, 0.0
    views = (scene.views[0], replace(scene.views[1], object_index=index, depth_m=depth_m), scene.views[2])
    _views(scene, tmp_path)
    report = write_labels(tmp_path, replace(scene, views=views), ("normals", "flow"))
    assert report.shown - report.labelled == 1 + 96
    normal, state = np.load(tmp_path / "1/normals.npy"), np.load(tmp_path / "1/flow_state.npy")
    for labelled in ((normal != 0).any(axis=3)[:5], state > 0):
        assert not labelled[2, 10, 20] and not labelled[3, 30].any() and not labelled[4, 0, :7].any()
        assert labelled.sum() == labelled.size - 1 - 96 - 7


def test_only_what_is_asked_for_is_written(tmp_path: Path, scene: Scene) -> None:
    folders = _views(scene, tmp_path)
    write_labels(tmp_path, scene, ("scene_flow",))
    assert {path.name for folder in folders for path in folder.iterdir()} == {"scene_flow.npy"}
    assert load_config("tiny", assignments=("export.outputs=[flow, normals]",)).export.outputs == ("flow", "normals")
    with pytest.raises(ConfigError, match=r"export\.outputs.*'object_index', 'normals'"):
        load_config("tiny", assignments=("export.outputs=[albedo]",))


def test_frames_of_another_shape_are_refused(tmp_path: Path) -> None:
    with FrameFile(tmp_path / "a.npy", (2, 3, 4), np.uint8) as file:
        file.append(np.ones((3, 4)))
        with pytest.raises(ValueError, match=r"must have shape \(3, 4\), not \(4, 3\)"):
            file.append(np.ones((4, 3)))
        file.append(np.full((3, 4), 7))
    np.testing.assert_array_equal(np.load(tmp_path / "a.npy"), np.repeat([[[1]], [[7]]], 12, axis=1).reshape(2, 3, 4))


def test_poses_hold_boxes_that_fit(scene: Scene) -> None:
    poses = object_poses(scene)
    crate = poses.world_from_object[0, 1].astype(np.float64)
    np.testing.assert_allclose(crate[:3, 3], [-1.6, 1.3, 0.35], atol=1e-6)
    assert np.arctan2(crate[1, 0], crate[0, 0]) == pytest.approx(0.6, abs=1e-5)
    np.testing.assert_allclose(poses.box_m[3, 1], [[-0.4, -0.3, -0.35], [0.4, 0.3, 0.35]], atol=1e-5)
    for frame in (0, 5):
        for place, actor in enumerate(scene.actors, len(scene.room.objects)):
            pose = poses.world_from_object[frame, place].astype(np.float64)
            own_m = (actor.vertices_m[frame] - pose[:3, 3]) @ pose[:3, :3]
            np.testing.assert_allclose(poses.box_m[frame, place], [own_m.min(axis=0), own_m.max(axis=0)], atol=1e-6)


def test_objects_of_any_shape_have_an_upright_frame() -> None:
    turned = trimesh.transformations.rotation_matrix(2.2, [0, 0, 1])[:3, :3]
    corners = np.array([[x, y, z] for x in (0.0, 2.0) for y in (0.0, 0.5) for z in (1.0, 4.0)])
    for vertices_m in (corners @ turned.T, corners[corners[:, 1] == 0.0] @ turned.T, corners[:1], np.zeros((0, 3))):
        pose = resting_pose(vertices_m)
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-12)
        np.testing.assert_array_equal(pose[2], [0.0, 0.0, 1.0, pose[2, 3]])
        assert abs(np.arctan2(pose[1, 0], pose[0, 0])) <= np.pi / 4 + 1e-9
        if len(vertices_m) > 1:
            own_m = (vertices_m - pose[:3, 3]) @ pose[:3, :3]
            assert np.sort(np.ptp(own_m, axis=0))[1:].tolist() == pytest.approx([2.0, 3.0], abs=1e-5)
