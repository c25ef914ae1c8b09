from pathlib import Path

from perpetua.machine.scripts import script_files, scripts_sha256


def test_hash_follows_imports_and_nothing_else(tmp_path: Path) -> None:
    for name, code in {
        "entry": "import os\nfrom helper import x",
        "helper": "def f():\n    import deep",
        "deep": "import entry",
        "other": "",
    }.items():
        (tmp_path / f"{name}.py").write_text(code)
    assert [path.stem for path in script_files("entry.py", tmp_path)] == ["deep", "entry", "helper"]
    before = scripts_sha256(("entry.py",), tmp_path)
    (tmp_path / "other.py").write_text("changed = 1")
    assert scripts_sha256(("entry.py",), tmp_path) == before
    (tmp_path / "deep.py").write_text("changed = 1")
    assert scripts_sha256(("entry.py",), tmp_path) != before


def test_room_and_render_do_not_share_their_entries() -> None:
    room = {path.name for path in script_files("infinigen_room.py")}
    render = {path.name for path in script_files("render_frames.py")}
    assert "infinigen_room.py" not in render
    assert "render_frames.py" not in room
    assert len(room) > 1
    assert len(render) > 1
