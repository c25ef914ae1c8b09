"""``perpetua view``: a recording read back shows what the sequence holds, where it is and when."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import rerun.dataframe
from click.testing import CliRunner

from perpetua.cli.app import main
from perpetua.formats.reader import Sequence, read_sequence
from perpetua.formats.rerun_meshes import entity_name, vertex_colours, vertex_normals
from perpetua.formats.rerun_recording import save_recording
from perpetua.formats.source import ExportSource
from perpetua.scene.room import Material
from perpetua.scene.scene import Scene
from perpetua.testing.synthetic_sequence import write_scene

FRAMES, VIEWS = 6, 3


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scene]:
    folder = tmp_path_factory.mktemp("view") / "sequence"
    scene, _ = write_scene(folder)
    return folder, scene


@pytest.fixture(scope="module")
def recording(made: tuple[Path, Scene], tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder, scene = made
    rendered = tuple(view.object_index for view in scene.views)
    source = ExportSource("sequence", read_sequence(folder), rendered, Scene(scene.room, scene.actors))
    target = tmp_path_factory.mktemp("recording") / "sequence.rrd"
    save_recording(source, target)
    return rerun.dataframe.load_recording(str(target))


def column(recording: Any, path: str, component: str, static: bool = False) -> list[Any]:
    """The values of a component at each frame, or its one value."""
    view = recording.view(index="frame", contents=path)
    table = (view.select_static() if static else view.select()).read_all()
    values: list[Any] = table[f"{path}:{component}"].to_pylist()
    return values[0] if static else values


def test_timelines_count_frames_and_seconds(recording: Any, made: tuple[Path, Scene]) -> None:
    assert {column.name for column in recording.schema().index_columns()} >= {"frame", "time"}
    table = recording.view(index="frame", contents="/world/view_0").select().read_all()
    assert table["frame"].to_pylist() == list(range(FRAMES))
    # The synthetic sequence records no rate, so 24 frames per second hold.
    seconds = [value.total_seconds() for value in table["time"].to_pylist()]
    np.testing.assert_allclose(seconds, np.arange(FRAMES) / 24.0, atol=1e-6)


def test_a_projected_track_lies_on_its_image_point(recording: Any, made: tuple[Path, Scene]) -> None:
    """With nothing but what the recording holds: poses, pinholes, world positions, points on the images, depth."""
    sequence = read_sequence(made[0])
    source = ExportSource("sequence", sequence)
    world_m = np.empty((FRAMES, sequence.tracks_m.shape[1], 3))
    for index in np.unique(source.track_object).tolist():
        path = f"/world/tracks/{entity_name(source, index)}"
        world_m[:, source.track_object == index] = np.array(column(recording, path, "Position3D"))
    compared = 0
    for number, view in enumerate(sequence.views):
        path = f"/world/view_{number}"
        turn = np.array(column(recording, path, "TransformMat3x3")).reshape(FRAMES, 3, 3)
        centre_m = np.array(column(recording, path, "Translation3D")).reshape(FRAMES, 3)
        pinhole = np.array(column(recording, f"{path}/image", "PinholeProjection", static=True)).reshape(3, 3).T
        points = column(recording, f"{path}/image/tracks", "Position2D")
        depths_mm = column(recording, f"{path}/depth", "ImageBuffer")
        for frame in range(FRAMES):
            seen = np.flatnonzero(view.visible[frame])
            # Rerun keeps matrices column by column, so this is camera from world.
            camera_m = (world_m[frame, seen] - centre_m[frame]) @ turn[frame].T
            image = camera_m @ pinhole.T
            np.testing.assert_allclose(image[:, :2] / image[:, 2:], np.array(points[frame]), atol=2e-3)
            depth_m = np.frombuffer(bytes(depths_mm[frame][0]), np.uint16).reshape(72, 96) / 1000.0
            x, y = np.array(points[frame]).astype(int).T
            near = np.abs(depth_m[y.clip(0, 71), x.clip(0, 95)] - camera_m[:, 2]) < 0.05 * camera_m[:, 2]
            assert near.mean() > 0.9
            compared += len(seen)
    assert compared > 300


def test_poses_are_the_cameras(recording: Any, made: tuple[Path, Scene]) -> None:
    for number, camera in enumerate(made[1].cameras):
        turn = np.array(column(recording, f"/world/view_{number}", "TransformMat3x3")).reshape(FRAMES, 3, 3)
        centre_m = np.array(column(recording, f"/world/view_{number}", "Translation3D")).reshape(FRAMES, 3)
        np.testing.assert_allclose(np.swapaxes(turn, 1, 2), camera.world_from_camera[:, :3, :3], atol=1e-6)
        np.testing.assert_allclose(centre_m, camera.world_from_camera[:, :3, 3], atol=1e-5)


def test_meshes_are_the_kept_ones(recording: Any, made: tuple[Path, Scene]) -> None:
    _, scene = made
    crate = scene.room.objects[1]
    position = column(recording, "/world/room/crate", "Position3D", static=True)
    np.testing.assert_allclose(position, crate.mesh.vertices_m, atol=1e-6)
    triangles = column(recording, "/world/room/crate", "TriangleIndices", static=True)
    np.testing.assert_array_equal(triangles, crate.mesh.faces)
    for actor in scene.actors:
        path = f"/world/people/person_{actor.object_index}"
        np.testing.assert_allclose(np.array(column(recording, path, "Position3D")), actor.vertices_m, atol=1e-6)
        np.testing.assert_array_equal(column(recording, path, "TriangleIndices", static=True), actor.faces)


def test_a_object_has_the_colour_that_the_images_show(recording: Any) -> None:
    """The synthetic renderer paints the crate orange, in shades."""
    (packed,) = column(recording, "/world/room/crate", "AlbedoFactor", static=True)
    red, green, blue = packed >> 24, packed >> 16 & 255, packed >> 8 & 255
    assert red > green + 30 > blue + 60


def test_vertex_colours_come_from_the_texture(made: tuple[Path, Scene]) -> None:
    actor = made[1].actors[0]
    image = np.zeros((2, 2, 3), np.uint8)
    image[0, 1] = (250, 10, 20)
    faces = np.array([[0, 1, 2]], np.int32)
    uv = np.array([[[0.9, 0.9], [0.1, 0.9], [0.9, 0.1]]], np.float32)
    part = replace(actor.parts[0], faces=faces, uv=uv, material=Material("skin", (0.0, 0.0, 0.0), image=image))
    colours = vertex_colours(replace(actor, parts=(part,)))
    assert colours[:3].tolist() == [[250, 10, 20], [0, 0, 0], [0, 0, 0]]


def test_normals_of_a_ball_point_outwards() -> None:
    import trimesh

    ball = trimesh.creation.icosphere(subdivisions=3)
    normals = vertex_normals(ball.vertices.astype(np.float32), ball.faces.astype(np.int32))
    np.testing.assert_allclose(normals, ball.vertices, atol=0.02)


def test_without_a_work_area_there_are_tracks_and_depth_but_no_meshes(
    made: tuple[Path, Scene], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(main, ["view", str(made[0])])
    assert done.exit_code == 0, done.output
    assert "wrote sequence.rrd" in done.output
    paths = {
        str(column.entity_path)
        for column in rerun.dataframe.load_recording("sequence.rrd").schema().component_columns()
    }
    assert "/world/view_0/depth" in paths and "/world/trails" in paths
    assert not [path for path in paths if path.startswith(("/world/room", "/world/shell", "/world/people"))]


def test_with_a_display_the_viewer_is_opened(
    made: tuple[Path, Scene], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import perpetua.formats.rerun_recording as exporter

    opened: list[Sequence] = []
    monkeypatch.setenv("DISPLAY", ":7")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(exporter, "open_viewer", lambda source: opened.append(source.sequence))
    done = CliRunner().invoke(main, ["view", str(made[0])])
    assert done.exit_code == 0, done.output
    assert [sequence.folder.name for sequence in opened] == ["sequence"]
    assert not list(tmp_path.iterdir())


def test_a_recording_of_another_ending_is_refused(made: tuple[Path, Scene], tmp_path: Path) -> None:
    done = CliRunner().invoke(main, ["view", str(made[0]), "--out", str(tmp_path / "sequence.mp4")])
    assert done.exit_code == 2 and "must end in .rrd, not 'sequence.mp4'" in done.output


def test_a_sequence_from_elsewhere_is_recorded(made: tuple[Path, Scene], tmp_path: Path) -> None:
    copy = tmp_path / "foreign"
    shutil.copytree(made[0], copy)
    for name in ("sequence.json", "surface_xyz.npy", "0/depth.npy"):
        (copy / name).unlink()
    done = CliRunner().invoke(main, ["view", str(copy), "--out", str(tmp_path / "foreign.rrd")])
    assert done.exit_code == 0, done.output
    columns = rerun.dataframe.load_recording(str(tmp_path / "foreign.rrd")).schema().component_columns()
    paths = {str(column.entity_path) for column in columns}
    assert "/world/view_0/depth" not in paths and "/world/view_1/depth" in paths
