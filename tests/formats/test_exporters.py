"""Exported sequences, read as their readers read them, by code that shares nothing with the exporters."""

import json
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

from perpetua.cli.app import main
from perpetua.errors import EnvironmentSetupError, InputError, SequenceFormatError
from perpetua.formats.kubric import scene_number
from perpetua.formats.reader import read_sequence
from perpetua.formats.source import EXPORTERS, ExportSource
from perpetua.runs.export import export_sequence
from perpetua.scene.scene import Scene
from perpetua.testing.synthetic_sequence import write_scene
from perpetua.tracks.types import SequenceTracks

NAME = "seed5-room0002"
FRAMES, VIEWS, WIDTH_PX, HEIGHT_PX = 6, 3, 96, 72


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene, SequenceTracks]:
    folder = tmp_path_factory.mktemp("out") / "train" / NAME
    scene, tracks = write_scene(folder)
    return folder, scene, tracks


@pytest.fixture(scope="module")
def kubric(made: tuple[Path, Scene, SequenceTracks], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The scene, with the rendered object index."""
    folder, scene, _ = made
    target = tmp_path_factory.mktemp("kubric")
    index = tuple(view.object_index for view in scene.views)
    EXPORTERS["kubric"]().write(ExportSource(NAME, read_sequence(folder), index), target)
    return target / "50002"


def _kubric_rotation(quaternion: np.ndarray) -> np.ndarray:
    """(F,3,3) of (w, x, y, z), written out from the definition of a rotation by a unit quaternion."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.moveaxis(np.array(rows), 2, 0)


def _kubric_camera(view: Path) -> tuple[np.ndarray, np.ndarray]:
    """OpenCV matrix (3,3) and world-to-camera (F,3,4) as the loader makes them of metadata.json."""
    metadata = json.loads((view / "metadata.json").read_text())
    width, height = metadata["metadata"]["resolution"]
    camera = metadata["camera"]
    world_from_opengl = np.tile(np.eye(4), (FRAMES, 1, 1))
    world_from_opengl[:, :3, :3] = _kubric_rotation(np.array(camera["quaternions"]))
    world_from_opengl[:, :3, 3] = np.array(camera["positions"])
    flip = np.diag([1.0, -1.0, -1.0])
    matrix = np.diag([width, height, 1.0]) @ np.array(camera["K"]) @ flip
    return matrix, flip @ np.linalg.inv(world_from_opengl)[:, :3]


def _kubric_depth(view: Path, frame: int) -> np.ndarray:
    """Z as the loader takes it from the distance, the sensor and the focal length."""
    camera = json.loads((view / "metadata.json").read_text())["camera"]
    distance = cv2.imread(str(view / f"depth_{frame:05d}.tiff"), cv2.IMREAD_UNCHANGED)
    assert distance.dtype == np.float32 and distance.shape == (HEIGHT_PX, WIDTH_PX)
    pitch = camera["sensor_width"] / WIDTH_PX
    x, y = np.meshgrid(
        (np.arange(WIDTH_PX) + 0.5 - WIDTH_PX / 2) * pitch, (np.arange(HEIGHT_PX) + 0.5 - HEIGHT_PX / 2) * pitch
    )
    return np.asarray(distance / np.sqrt(1.0 + (x**2 + y**2) / camera["focal_length"] ** 2))


def test_kubric_scene_has_what_the_loader_opens(kubric: Path) -> None:
    frames = [f"{name}_{frame:05d}.{end}" for frame in range(FRAMES) for name, end in
              (("depth", "tiff"), ("rgba", "png"), ("segmentation", "png"))]  # fmt: skip
    others = ["metadata.json", "object_id_to_segmentation_id.json", "tracks_2d.npz"]
    for view in range(VIEWS):
        assert sorted(path.name for path in (kubric / f"view_{view}").iterdir()) == sorted(frames + others)
    assert sorted(path.name for path in kubric.iterdir()) == [
        "cameras.npz", "tracked_objects.json", "tracks_3d.npz", "tracks_segmentation_ids.npz",
        *(f"view_{view}" for view in range(VIEWS)),
    ]  # fmt: skip
    tracks = np.load(kubric / "tracks_3d.npz")["tracks_3d"]
    cameras = np.load(kubric / "cameras.npz")
    assert (tracks.dtype, tracks.shape) == (np.float64, (FRAMES, 200, 3))
    assert cameras["camera_positions"].shape == cameras["lookat_positions"].shape == (VIEWS, 3)
    occlusion = np.load(kubric / "view_0" / "tracks_2d.npz")["occlusion"]
    assert (occlusion.dtype, occlusion.shape) == (np.bool_, (FRAMES, 200))


def test_kubric_tracks_project_to_their_pixels_through_the_metadata(
    kubric: Path, made: tuple[Path, Scene, SequenceTracks]
) -> None:
    _, scene, tracks = made
    world = np.load(kubric / "tracks_3d.npz")["tracks_3d"]
    homogeneous = np.concatenate([world, np.ones((*world.shape[:2], 1))], axis=2)
    cameras = np.load(kubric / "cameras.npz")
    for view in range(VIEWS):
        matrix, camera_from_world = _kubric_camera(kubric / f"view_{view}")
        assert matrix[0, 2] == pytest.approx(WIDTH_PX / 2) and matrix[1, 2] == pytest.approx(HEIGHT_PX / 2)
        image = np.einsum("ij,fjk,fpk->fpi", matrix, camera_from_world, homogeneous)
        stored = np.load(kubric / f"view_{view}" / "tracks_2d.npz")
        assert stored["tracks_2d"].dtype == np.float64
        np.testing.assert_allclose(image[..., :2] / image[..., 2:], stored["tracks_2d"], rtol=1e-9, atol=1e-8)
        np.testing.assert_array_equal(stored["occlusion"], ~tracks.views.visible[view])
        seen = tracks.views.visible[view]
        # Theirs counts from the corner of the top-left pixel, ours from its centre.
        ours = tracks.views.pixel_px[view][seen] + 0.5
        np.testing.assert_allclose(stored["tracks_2d"][seen], ours, atol=2e-4)
        pose = scene.cameras[view].world_from_camera[0]
        np.testing.assert_allclose(cameras["camera_positions"][view], pose[:3, 3], atol=1e-5)
        away = cameras["lookat_positions"][view] - cameras["camera_positions"][view]
        np.testing.assert_allclose(away, pose[:3, 2], atol=1e-6)


def test_kubric_depth_puts_the_walls_where_they_are(kubric: Path, made: tuple[Path, Scene, SequenceTracks]) -> None:
    """Every pixel of the room's shell lies on one of its six planes: half-pixel, ray and axis mistakes all show."""
    _, scene, _ = made
    columns, rows = np.meshgrid(np.arange(WIDTH_PX) + 0.5, np.arange(HEIGHT_PX) + 0.5)
    for view in range(VIEWS):
        folder = kubric / f"view_{view}"
        matrix, camera_from_world = _kubric_camera(folder)
        for frame in (0, FRAMES - 1):
            depth = _kubric_depth(folder, frame)
            np.testing.assert_allclose(depth, scene.views[view].depth_m[frame], rtol=1e-5)
            segmentation = cv2.imread(str(folder / f"segmentation_{frame:05d}.png"), cv2.IMREAD_UNCHANGED)
            assert segmentation.dtype == np.uint16
            np.testing.assert_array_equal(segmentation, scene.views[view].object_index[frame])
            ray = np.stack([columns, rows, np.ones_like(rows)], axis=-1) @ np.linalg.inv(matrix).T
            pose = camera_from_world[frame]
            world = (ray * depth[..., None] - pose[:, 3]) @ pose[:, :3]
            shell = world[segmentation == 1]
            off = np.abs(np.concatenate([shell - [3.0, 2.5, 2.8], shell - [-3.0, -2.5, 0.0]], axis=1)).min(axis=1)
            assert len(shell) > 2000 and off.max() < 1e-4


def test_kubric_pictures_are_the_sequence_s(kubric: Path, made: tuple[Path, Scene, SequenceTracks]) -> None:
    rgba = np.array(Image.open(kubric / "view_1" / "rgba_00003.png"))
    assert rgba.shape == (HEIGHT_PX, WIDTH_PX, 4) and (rgba[..., 3] == 255).all()
    jpeg = np.array(Image.open(BytesIO(made[1].views[1].jpeg[3])))
    assert np.abs(rgba[..., :3].astype(int) - jpeg).max() <= 2


def test_kubric_ids_name_the_objects_of_tracks(kubric: Path, made: tuple[Path, Scene, SequenceTracks]) -> None:
    ids = np.load(kubric / "tracks_segmentation_ids.npz")["tracks_segmentation_ids"]
    np.testing.assert_array_equal(ids, made[2].points.object_index)
    tracked = json.loads((kubric / "tracked_objects.json").read_text())
    assert tracked["ids"] == sorted(set(ids.tolist()))
    table = json.loads((kubric / "view_0" / "object_id_to_segmentation_id.json").read_text())
    assert [table[name] for name in tracked["names"]] == tracked["ids"]


def test_kubric_without_work_area_tells_people_from_the_rest(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path
) -> None:
    folder, scene, tracks = made
    (written,) = export_sequence(folder, "kubric", tmp_path)
    assert written == tmp_path / "50002"
    for view in range(VIEWS):
        segmentation = cv2.imread(str(written / f"view_{view}" / "segmentation_00002.png"), cv2.IMREAD_UNCHANGED)
        np.testing.assert_array_equal(segmentation, scene.views[view].object_index[2] > 4)
    ids = np.load(written / "tracks_segmentation_ids.npz")["tracks_segmentation_ids"]
    np.testing.assert_array_equal(ids, tracks.points.object_index > 4)
    table = json.loads((written / "view_0" / "object_id_to_segmentation_id.json").read_text())
    assert sorted(table.values()) == [0, 0, 0, 0, 1, 1]
    assert json.loads((written / "tracked_objects.json").read_text()) == {
        "ids": [0, 1],
        "names": ["background", "people"],
    }


def test_kubric_takes_the_object_index_of_the_sequence_itself(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path
) -> None:
    folder, scene, tracks = made
    copy = _copy(folder, tmp_path / NAME)
    for view, rendered in enumerate(scene.views):
        np.save(copy / f"{view}/object_index.npy", rendered.object_index)
    (written,) = export_sequence(copy, "kubric", tmp_path / "out")
    segmentation = cv2.imread(str(written / "view_2" / "segmentation_00004.png"), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(segmentation, scene.views[2].object_index[4])
    ids = np.load(written / "tracks_segmentation_ids.npz")["tracks_segmentation_ids"]
    np.testing.assert_array_equal(ids, tracks.points.object_index)


def test_a_sequence_of_others_needs_no_record(made: tuple[Path, Scene, SequenceTracks], tmp_path: Path) -> None:
    """Which tracks are on people is then read off the mask, at the pixels that show them."""
    copy = _copy(made[0], tmp_path / "in" / "clip12")
    (copy / "sequence.json").unlink()
    for name in ("kubric", "tapvid3d"):
        export_sequence(copy, name, tmp_path / "out")
    ids = np.load(tmp_path / "out" / "12" / "tracks_segmentation_ids.npz")["tracks_segmentation_ids"]
    people = made[2].points.object_index > 4
    assert 0 < people.sum() < len(people) and (ids == people).mean() > 0.98


def test_a_record_of_other_tracks_is_refused(made: tuple[Path, Scene, SequenceTracks], tmp_path: Path) -> None:
    copy = _copy(made[0], tmp_path / NAME)
    record = json.loads((copy / "sequence.json").read_text())
    record["tracks"]["object_index"].pop()
    (copy / "sequence.json").write_text(json.dumps(record))
    with pytest.raises(SequenceFormatError, match="objects of 199 tracks and there are 200"):
        export_sequence(copy, "kubric", tmp_path / "out")


def test_kubric_refuses_what_its_loader_would_read_wrong(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path
) -> None:
    copy = _copy(made[0], tmp_path / NAME)
    intrinsics = np.load(copy / "1" / "intrinsics.npy")
    np.save(copy / "1" / "intrinsics.npy", intrinsics + np.array([0, 0, 2, 0], np.float32))
    with pytest.raises(SequenceFormatError, match=r"view 1 .* principal point 2\.000 px off"):
        export_sequence(copy, "kubric", tmp_path / "out")
    np.save(copy / "1" / "intrinsics.npy", intrinsics)
    (copy / "2" / "depth.npy").unlink()
    with pytest.raises(SequenceFormatError, match="view 2 has no depth"):
        export_sequence(copy, "kubric", tmp_path / "out")
    assert list((tmp_path / "out").iterdir()) == []
    with pytest.raises(InputError, match="needs digits"):
        scene_number("kitchen")


def test_tapvid3d_is_read_without_pickle_and_its_queries_lie_on_its_tracks(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path
) -> None:
    folder, scene, tracks = made
    written = export_sequence(folder, "tapvid3d", tmp_path)
    assert [path.name for path in written] == [f"{NAME}_{view}.npz" for view in range(VIEWS)]
    for view, path in enumerate(written):
        content = np.load(path, allow_pickle=False)
        seen = tracks.views.visible[view].any(axis=0)
        assert [bytes(jpeg) for jpeg in content["images_jpeg_bytes"]] == list(scene.views[view].jpeg)
        np.testing.assert_array_equal(content["visibility"], tracks.views.visible[view][:, seen])
        fx, fy, cx, cy = content["fx_fy_cx_cy"]
        assert (cx, cy) == (WIDTH_PX / 2, HEIGHT_PX / 2)
        xyz = content["tracks_XYZ"]
        pose = scene.cameras[view].world_from_camera
        world = np.einsum("fij,fpj->fpi", pose[:, :3, :3], xyz) + pose[:, None, :3, 3]
        np.testing.assert_allclose(world, tracks.points.position_m[:, seen], atol=1e-5)
        np.testing.assert_allclose(content["extrinsics_w2c"] @ pose, np.tile(np.eye(4), (FRAMES, 1, 1)), atol=1e-6)
        x, y, frame = content["queries_xyt"].T
        at = (frame.astype(int), np.arange(len(x)))
        assert content["visibility"][at].all() and len(set(frame.tolist())) == FRAMES
        z = xyz[at][:, 2]
        np.testing.assert_allclose(x, fx * xyz[at][:, 0] / z + cx, atol=1e-4)
        np.testing.assert_allclose(y, fy * xyz[at][:, 1] / z + cy, atol=1e-4)
        # Raster coordinates, as that benchmark's code takes them: their floor is the pixel that shows the point.
        columns, rows = np.floor(x).astype(int), np.floor(y).astype(int)
        shown = scene.views[view].object_index[frame.astype(int), rows, columns]
        assert (shown == tracks.points.object_index[seen]).mean() > 0.9


@pytest.mark.parametrize("name", ["kubric", "tapvid3d"])
def test_equal_sequences_give_equal_bytes(name: str, made: tuple[Path, Scene, SequenceTracks], tmp_path: Path) -> None:
    export_sequence(made[0], name, tmp_path / "a")
    export_sequence(made[0], name, tmp_path / "b")
    files = [path.relative_to(tmp_path / "a") for path in (tmp_path / "a").rglob("*") if path.is_file()]
    assert len(files) >= VIEWS
    for path in files:
        assert (tmp_path / "a" / path).read_bytes() == (tmp_path / "b" / path).read_bytes(), path


def test_rerun_recording_is_read_back(made: tuple[Path, Scene, SequenceTracks], tmp_path: Path) -> None:
    import rerun.dataframe

    folder, scene, tracks = made
    (written,) = export_sequence(folder, "rerun", tmp_path)
    assert written.name == f"{NAME}.rrd"
    recording = rerun.dataframe.load_recording(str(written))
    columns = {str(column.entity_path) for column in recording.schema().component_columns()}
    assert {f"/world/view_{view}/{what}" for view in range(VIEWS) for what in ("image", "depth")} <= columns
    assert {"/world/tracks/person_5", "/world/tracks/crate", "/world/trails"} <= columns
    table = recording.view(index="frame", contents="/world/tracks/person_5").select().read_all()
    assert table["frame"].to_pylist() == list(range(FRAMES))
    position = table["/world/tracks/person_5:Position3D"].to_pylist()
    of_person = tracks.points.position_m[:, tracks.points.object_index == 5]
    np.testing.assert_allclose(np.array(position), of_person, atol=1e-5)
    colours = {tuple(row) for row in table["/world/tracks/person_5:Color"].to_pylist()}
    assert len(colours) == 1 and len(set(colours.pop())) == 1
    image = recording.view(index="frame", contents="/world/view_1/image").select().read_all()
    blobs = image["/world/view_1/image:Blob"].to_pylist()
    assert [bytes(blob[0]) for blob in blobs] == list(scene.views[1].jpeg)


def test_rerun_without_its_sdk_names_the_extra(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rerun", None)
    with pytest.raises(EnvironmentSetupError, match=r"pip install 'perpetua\[rerun\]'"):
        export_sequence(made[0], "rerun", tmp_path)


def test_command_exports_all_sequences_of_a_folder_and_overwrites_none(
    made: tuple[Path, Scene, SequenceTracks], tmp_path: Path
) -> None:
    arguments = ["export", str(made[0].parent.parent), "--out", str(tmp_path), "--format"]
    done = CliRunner().invoke(main, [*arguments, "tapvid3d"])
    assert done.exit_code == 0 and done.output.count("wrote") == VIEWS
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    again = CliRunner().invoke(main, [*arguments, "tapvid3d"])
    assert again.exit_code == 2 and "exists: choose another --out" in again.output
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    wrong = CliRunner().invoke(main, [*arguments, "kubrik"])
    assert wrong.exit_code == 2 and "did you mean 'kubric'" in wrong.output


def _copy(folder: Path, target: Path) -> Path:
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            (target / path.relative_to(folder)).parent.mkdir(parents=True, exist_ok=True)
            (target / path.relative_to(folder)).write_bytes(path.read_bytes())
    return target
