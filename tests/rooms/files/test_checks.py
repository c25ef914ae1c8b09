"""What is refused before Blender sees a scene file, and what stays at home."""

import json
import struct
from pathlib import Path
from typing import Any

import pytest

from perpetua.errors import InputError
from perpetua.rooms.acceptance.build import check_source
from perpetua.rooms.config import RoomsConfig, SceneFileConfig
from perpetua.rooms.files import source as scene_file
from perpetua.rooms.files.checks import BadSceneFile, check_scene_file, find_scene_files, scene_digests
from perpetua.rooms.files.source import SceneFileRooms, trace_floor
from perpetua.rooms.source import RoomRejected, RoomWish
from perpetua.seeding import StageSeed

WISH = RoomWish("kitchen", (6.0, 6.0, 2.8), "day", True)


def _glb(path: Path, tree: object, length: int | None = None) -> Path:
    text = json.dumps(tree).encode()
    text += b" " * (-len(text) % 4)
    whole = 20 + len(text)
    header = struct.pack("<III", 0x46546C67, 2, whole if length is None else length)
    path.write_bytes(header + struct.pack("<II", len(text), 0x4E4F534A) + text)
    return path


def _tree(**more: Any) -> dict[str, Any]:
    return {"asset": {"version": "2.0"}, **more}


def _check(path: Path, max_file_mb: float = 10.0, max_triangles: int = 1000) -> None:
    check_scene_file(path, max_file_mb, max_triangles)


def _rule(path: Path, **limits: Any) -> str:
    with pytest.raises(BadSceneFile) as bad:
        _check(path, **limits)
    return bad.value.rule


@pytest.mark.parametrize("suffix", [".blend", ".glb", ".gltf", ".obj"])
@pytest.mark.parametrize("content", [b"", b"\x89PNG\r\n\x1a\n" + bytes(200), b"hello there, this is a letter\n"])
def test_what_is_not_the_format_is_refused(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"scene{suffix}"
    path.write_bytes(content)
    assert _rule(path) == "format"


def test_a_sound_glb_passes_and_a_truncated_one_does_not(tmp_path: Path) -> None:
    path = _glb(tmp_path / "scene.glb", _tree())
    _check(path)
    path.write_bytes(path.read_bytes()[:-4])
    assert _rule(path) == "truncated"


def test_lengths_that_lie_are_refused(tmp_path: Path) -> None:
    assert _rule(_glb(tmp_path / "scene.glb", _tree(), length=4_000_000_000)) == "truncated"
    text = _glb(tmp_path / "scene.glb", _tree()).read_bytes()
    (tmp_path / "scene.glb").write_bytes(text[:12] + struct.pack("<I", 4_000_000_000) + text[16:])
    assert _rule(tmp_path / "scene.glb") == "truncated"


@pytest.mark.parametrize(
    "uri",
    [
        "../secret.bin",
        "a/../../secret.bin",
        "%2e%2e/secret.bin",
        "..%2Fsecret.bin",
        "/etc/hostname",
        "file:///etc/hostname",
        "http://example.org/scene.bin",
        "HTTPS://example.org/scene.bin",
        "C:\\secret.bin",
        "..\\secret.bin",
        "\\\\host\\share",
        "out/secret.bin",
        "missing.bin",
    ],
)
@pytest.mark.parametrize("place", ["buffers", "images", "extensions"])
def test_uris_that_lead_out_are_refused(tmp_path: Path, uri: str, place: str) -> None:
    (tmp_path / "secret.bin").write_bytes(b"secret")
    home = tmp_path / "home"
    home.mkdir()
    # A link inside the folder that leads out of it.
    (home / "out").symlink_to(tmp_path)
    entry = [{"uri": uri}]
    tree = _tree(**{place: {"X_any": {"files": entry}} if place == "extensions" else entry})
    assert _rule(_glb(home / "scene.glb", tree)) == "references"
    (home / "scene.gltf").write_text(json.dumps(tree), encoding="utf-8")
    assert _rule(home / "scene.gltf") == "references"


def test_files_beside_the_scene_and_data_in_it_pass(tmp_path: Path) -> None:
    (tmp_path / "my textures").mkdir()
    (tmp_path / "my textures" / "wall.png").write_bytes(b"png")
    uris = [{"uri": "my%20textures/wall.png"}, {"uri": "data:application/octet-stream;base64,AAAA"}]
    (tmp_path / "scene.gltf").write_text(json.dumps(_tree(images=uris)), encoding="utf-8")
    _check(tmp_path / "scene.gltf")


@pytest.mark.parametrize("library", ["../room.mtl", "/etc/hostname", "C:\\room.mtl", "missing.mtl"])
def test_material_libraries_of_an_obj_stay_at_home(tmp_path: Path, library: str) -> None:
    (tmp_path / "room.mtl").write_text("newmtl a\n", encoding="utf-8")
    home = tmp_path / "home"
    home.mkdir()
    (home / "room.obj").write_text(f"v 0 0 0\nmtllib {library}\n", encoding="utf-8")
    assert _rule(home / "room.obj") == "references"
    (home / "room.mtl").write_text("newmtl a\n", encoding="utf-8")
    (home / "room.obj").write_text("# by hand\nv 0 0 0\nmtllib room.mtl\n", encoding="utf-8")
    _check(home / "room.obj")


def test_size_counts_what_is_referred_to(tmp_path: Path) -> None:
    (tmp_path / "scene.bin").write_bytes(bytes(2_000_000))
    (tmp_path / "scene.gltf").write_text(json.dumps(_tree(buffers=[{"uri": "scene.bin"}])), encoding="utf-8")
    _check(tmp_path / "scene.gltf", max_file_mb=2.1)
    assert _rule(tmp_path / "scene.gltf", max_file_mb=2.0) == "size"


def test_triangles_are_counted_as_often_as_they_are_shown(tmp_path: Path) -> None:
    mesh = {"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}, {"attributes": {"POSITION": 0}, "mode": 5}]}
    tree = _tree(accessors=[{"count": 12}, {"count": 30}], meshes=[mesh], nodes=[{"mesh": 0}] * 5)
    # 30 / 3 triangles and a strip of 12 - 2, five times.
    _check(_glb(tmp_path / "scene.glb", tree), max_triangles=100)
    assert _rule(tmp_path / "scene.glb", max_triangles=99) == "triangles"
    (tmp_path / "scene.obj").write_text("v 0 0 0\nf 1 2 3 4\nf 1 2 3\n", encoding="utf-8")
    _check(tmp_path / "scene.obj", max_triangles=3)
    assert _rule(tmp_path / "scene.obj", max_triangles=2) == "triangles"


@pytest.mark.parametrize(
    "tree", [[], {}, _tree(meshes=[{}], nodes=[{"mesh": 0}]), _tree(meshes=5), _tree(nodes=[{"mesh": 3}])]
)
def test_damaged_tables_are_refused(tmp_path: Path, tree: object) -> None:
    assert _rule(_glb(tmp_path / "scene.glb", tree)) == "format"


def test_paths_are_checked_before_work_begins(tmp_path: Path) -> None:
    def refusal(path: str | None) -> str:
        with pytest.raises(InputError) as error:
            check_source(RoomsConfig(source="file", file=SceneFileConfig(path=path)))
        assert error.value.exit_code == 2
        return str(error.value)

    (tmp_path / "scene.fbx").write_bytes(b"x")
    (tmp_path / "letter.glb").write_bytes(b"hello")
    (tmp_path / "empty").mkdir()
    assert "set rooms.file.path" in refusal(None)
    assert "does not exist" in refusal(str(tmp_path / "none.glb"))
    assert ".blend, .glb, .gltf, .obj, not 'scene.fbx'" in refusal(str(tmp_path / "scene.fbx"))
    assert "has none" in refusal(str(tmp_path / "empty"))
    assert "letter.glb': it is no binary glTF file" in refusal(str(tmp_path / "letter.glb"))


def test_a_folder_gives_every_file_once_in_the_seeds_order(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in "dbca":
        _glb(tmp_path / f"{name}.glb", _tree())
    (tmp_path / "notes.txt").write_text("not a scene", encoding="utf-8")
    assert [path.name for path in find_scene_files(str(tmp_path))] == ["a.glb", "b.glb", "c.glb", "d.glb"]

    def refuse(self: SceneFileRooms, path: Path, config: RoomsConfig, scratch: Path) -> None:
        raise BadSceneFile("seen", path.name)

    monkeypatch.setattr(scene_file.SceneFileRooms, "_read", refuse)
    config = RoomsConfig(source="file", file=SceneFileConfig(path=str(tmp_path)))

    def order(seed: StageSeed) -> list[str]:
        names = []
        for attempt in range(4):
            with pytest.raises(RoomRejected) as rejection:
                SceneFileRooms().make(WISH, config, seed, attempt, tmp_path / "scratch")
            names.append(str(rejection.value)[-5:])
        return names

    orders = {tuple(order(StageSeed(7, room, "room"))) for room in range(12)}
    assert {tuple(sorted(names)) for names in orders} == {("a.glb", "b.glb", "c.glb", "d.glb")}
    assert {names[0] for names in orders} == {"a.glb", "b.glb", "c.glb", "d.glb"}
    assert order(StageSeed(7, 3, "room")) == order(StageSeed(7, 3, "room"))


def test_digests_follow_the_content_of_the_scene_and_its_files(tmp_path: Path) -> None:
    (tmp_path / "scene.bin").write_bytes(b"one")
    (tmp_path / "scene.gltf").write_text(json.dumps(_tree(buffers=[{"uri": "scene.bin"}])), encoding="utf-8")
    first = scene_digests(str(tmp_path))
    assert list(first) == ["scene.gltf"]
    _glb(tmp_path / "other.glb", _tree())
    assert scene_digests(str(tmp_path))["scene.gltf"] == first["scene.gltf"]
    (tmp_path / "scene.gltf").write_text(json.dumps(_tree(extras=1)), encoding="utf-8")
    assert scene_digests(str(tmp_path))["scene.gltf"] != first["scene.gltf"]
    assert scene_digests(None) == scene_digests("nowhere") == {}


def test_an_l_shaped_floor_is_traced_and_a_rectangle_left_alone() -> None:
    rows = ["#" * 40] * 30 + ["#" * 20 + "." * 20] * 30
    cells = {"rows": rows, "cell_m": 0.1, "corner_m": [-3.0, -2.0]}
    outline_m = trace_floor(cells)
    assert outline_m is not None
    assert len(outline_m) == 6
    x_m, y_m = outline_m.T
    area_m2 = 0.5 * float((x_m * (y_m.take(range(1, 7), mode="wrap")) - y_m * x_m.take(range(1, 7), mode="wrap")).sum())
    # 3 m x 4 m and 3 m x 2 m, counter-clockwise.
    assert area_m2 == pytest.approx(18.0, rel=0.03)
    assert outline_m.min(0) == pytest.approx([-3.0, -2.0], abs=0.05)
    assert outline_m.max(0) == pytest.approx([3.0, 2.0], abs=0.05)
    assert trace_floor({"rows": ["#" * 40] * 30, "cell_m": 0.1, "corner_m": [0.0, 0.0]}) is None
