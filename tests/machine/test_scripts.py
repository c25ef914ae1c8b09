from pathlib import Path

from perpetua.machine.scripts import script_files, scripts_sha256
from perpetua.rendering.job import RENDER_SCRIPT
from perpetua.rooms.infinigen import SCRIPT as INFINIGEN_SCRIPT


def test_hash_follows_imports_and_nothing_else(tmp_path: Path) -> None:
    for name, code in {
        "entry": "import os\nfrom blender_scripts.part.helper import x",
        "part/helper": "def f():\n    from blender_scripts import deep",
        "deep": "import blender_scripts.entry",
        "other": "",
    }.items():
        path = tmp_path / f"{name}.py"
        path.parent.mkdir(exist_ok=True)
        path.write_text(code)
    assert [path.stem for path in script_files(tmp_path / "entry.py", tmp_path)] == ["deep", "entry", "helper"]
    before = scripts_sha256((tmp_path / "entry.py",), tmp_path)
    (tmp_path / "other.py").write_text("changed = 1")
    assert scripts_sha256((tmp_path / "entry.py",), tmp_path) == before
    (tmp_path / "deep.py").write_text("changed = 1")
    assert scripts_sha256((tmp_path / "entry.py",), tmp_path) != before


def test_room_and_render_do_not_share_their_entries() -> None:
    room = {path.name for path in script_files(INFINIGEN_SCRIPT)}
    render = {path.name for path in script_files(RENDER_SCRIPT)}
    assert "infinigen_room.py" not in render
    assert "render_frames.py" not in room
    assert len(room) > 1
    assert len(render) > 1
