"""What the README and docs/ say works: every command runs here, on a small sequence and without Blender."""

import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

from perpetua.actors.bodies.assembly import check_people
from perpetua.cli.app import main
from perpetua.config import load_config
from perpetua.config.reference import markdown_page
from perpetua.formats.reader import read_sequence
from perpetua.pipeline.stages import STAGE_NAMES
from perpetua.rooms.acceptance.build import check_source
from perpetua.testing.synthetic_sequence import write_scene
from tests.support.doc_pages import ALL_PAGES, PROGRAMS, ROOT, DocCommand, blocks, commands
from tests.support.makehuman_files import write_folder
from tests.support.small_run import write_run

COMMANDS = commands()
OURS = [command for command in COMMANDS if command.words[0] in PROGRAMS]
# Not run here, and what runs them.
ELSEWHERE = {
    "sudo apt-get install -y python3.11-venv": "test_doctor_knows_the_packages_the_readme_names",
    "./setup.sh": ".ci/run",
    ".venv/bin/pip install -e .[rerun]": "rerun-sdk is in requirements-dev.lock, which .ci/run installs",
    ".venv/bin/python -m pytest": ".ci/run",
    ".venv/bin/python docs/examples/show_batch.py": "tests/blender/test_docs_python.py",
}


def _stays_undone(command: DocCommand) -> bool:
    """Rooms and people are drawn by Blender, and a cluster is not here: tests/blender and tests/cluster do these."""
    drawn = command.arguments[0] == "preview" and bool({"--rooms", "--actors"} & set(command.arguments))
    return drawn or command.arguments[0] == "submit"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with all that the pages' commands name."""
    place = tmp_path_factory.mktemp("run")
    write_run(place / "data", seed=7)
    write_run(place / "out", seed=3)
    (place / "predictions").mkdir()
    sequence = "seed7-room0000"
    scored = ["evaluate", str(place / "data/train" / sequence), "--baseline", "still"]
    assert CliRunner().invoke(main, [*scored, "--save", str(place / f"predictions/{sequence}.npz")]).exit_code == 0
    files = (
        "clips/walk_01.npz", "clips/cmu/07_01.bvh", "smplx/SMPLX_FEMALE.npz",
        "smplx/SMPLX_MALE.npz", "bedlam2/bald/skin_f_01_ALB.png", "kimodo_gen",
    )  # fmt: skip
    for name in files:
        (place / name).parent.mkdir(parents=True, exist_ok=True)
        (place / name).touch()
    (place / "kimodo_gen").chmod(0o755)
    (place / "scenes").mkdir()
    trimesh.creation.box((6.0, 5.0, 2.8)).export(str(place / "scenes/flat.glb"))
    (place / "clips/index.yaml").write_text(blocks("docs/own_motion.md", "yaml")[0])
    (place / "mine.yaml").write_text(blocks("docs/tutorial.md", "yaml")[0])
    write_folder(place / "makehuman")
    return place


@pytest.mark.parametrize("command", COMMANDS, ids=str)
def test_every_command_is_ours_or_run_elsewhere(command: DocCommand) -> None:
    text = " ".join(command.words)
    assert command.words[0] in PROGRAMS or any(text.startswith(known) for known in ELSEWHERE)


@pytest.mark.parametrize("command", OURS, ids=str)
def test_command_runs(command: DocCommand, run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "place"
    shutil.copytree(run, place)
    monkeypatch.chdir(place)
    monkeypatch.setenv("PATH", str(place), prepend=":")
    # What the pages ask for is more than a test machine's disk may hold.
    roomy = shutil.disk_usage(place)._replace(free=10**14)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: roomy)
    for display in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(display, raising=False)
    if _stays_undone(command):
        _check_settings(command)
        return
    done = CliRunner().invoke(main, _small(command.arguments), catch_exceptions=False)
    assert done.exit_code in ((0, 1) if command.arguments[0] in ("verify", "doctor") else (0,)), done.output
    assert done.output


def _check_settings(command: DocCommand) -> None:
    """Options, settings and the files that they name, as far as they are checked before the work begins."""
    name, *rest = command.arguments
    options = main.commands[name].make_context(name, list(rest)).params
    config = load_config(options["preset"], options["config_path"], options["assignments"])
    check_source(config.rooms)
    check_people(config.actors)


def _small(arguments: list[str]) -> list[str]:
    """The same command with nothing rendered and few tracks."""
    if arguments[0] == "generate" and not {"--dry-run", "--help"} & set(arguments):
        return [*arguments, "--dry-run"]
    if "--count" in arguments:
        arguments[arguments.index("--count") + 1] = "100"
    return arguments


@pytest.mark.parametrize("page", ALL_PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_links_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"(?:\]\(|(?:href|src)=\")([^)#\"]+)", page.read_text(encoding="utf-8"))
    missing = [target for target in targets if "://" not in target and not (page.parent / target).exists()]
    assert missing == []


def test_settings_page_is_what_the_program_says() -> None:
    page = (ROOT / "docs/settings.md").read_text(encoding="utf-8")
    remedy = "out of date: run .venv/bin/perpetua config --format markdown > docs/settings.md"
    assert page == markdown_page(load_config("standard")) + "\n", remedy


def test_drawing_of_the_architecture_has_every_stage_in_order() -> None:
    drawing = (ROOT / "docs/architecture.svg").read_text(encoding="utf-8")
    named = re.findall(r">\d\d (\w+)<", drawing)
    assert tuple(named) == STAGE_NAMES


def test_pictures_are_small() -> None:
    most_bytes = {".jpg": 400_000, ".png": 400_000, ".svg": 400_000, ".webp": 500_000}
    pictures = [path for path in (ROOT / "docs").rglob("*") if path.suffix in most_bytes]
    assert pictures
    assert [path.name for path in pictures if path.stat().st_size > most_bytes[path.suffix]] == []


def test_the_reader_of_the_page_reads_what_ours_does(tmp_path: Path) -> None:
    write_scene(tmp_path / "sequence")
    code = blocks("docs/file_format.md", "python")[0]
    reader = code.partition("def read")[2].partition("\ndef ")[0]
    assert len(reader.strip().splitlines()) <= 15
    names: dict[str, Any] = {}
    exec(code, names)
    tracks, queries, views = names["read"](tmp_path / "sequence")
    sequence = read_sequence(tmp_path / "sequence")
    assert np.array_equal(tracks, sequence.tracks_m) and np.array_equal(queries, sequence.queries_xytv)
    assert len(views) == len(sequence.views)
    for view, ours in zip(views, sequence.views, strict=True):
        assert np.array_equal(view["images"][3], ours.image(3))
        assert np.array_equal(view["visibility"], ours.visible)
    # Each query is the projection of its track.
    number, frame, place = 5, int(queries[5, 2]), int(queries[5, 3])
    pixel_px, depth_m = names["project"](tracks, views[place])
    assert np.allclose(pixel_px[frame, number], queries[number, :2], atol=1e-2)
    assert depth_m[frame, number] > 0


def test_the_page_on_extending_shows_the_files_of_the_package_that_is_tested() -> None:
    """tests/packaging installs that package, passes it through the suites, and makes a sequence with it."""
    package = ROOT / "tests" / "plugin"
    modules = [path for path in sorted(package.rglob("*.py")) if path.name != "__init__.py"]
    shown = [*blocks("docs/extending.md", "python"), *blocks("docs/extending.md", "toml")]
    files = [path.read_text(encoding="utf-8") for path in (*modules, package / "pyproject.toml")]
    assert len(files) == 5
    assert sorted(text.strip() for text in shown) == sorted(text.strip() for text in files)
