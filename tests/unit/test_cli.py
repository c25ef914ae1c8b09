"""The command line as a user meets it."""

import json
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

import perpetua
from perpetua.cli import main
from perpetua.pipeline.stages import STAGE_NAMES
from perpetua.system_libraries import SYSTEM_LIBRARIES


def _perpetua(*arguments: str) -> Result:
    return CliRunner().invoke(main, list(arguments))


def test_every_command_explains_itself() -> None:
    assert set(main.commands) >= {"generate", "status", "verify", "preview", "assets", "doctor", "clean"}
    for name, command in main.commands.items():
        assert _perpetua(name, "--help").exit_code == 0
        assert command.help
        for option in command.params:
            if isinstance(option, click.Option):
                assert option.help, f"{name} {option.opts}"


def test_version() -> None:
    assert _perpetua("--version").output.strip() == f"perpetua, version {perpetua.__version__}"


def test_dry_run_says_the_cost_and_writes_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out"
    done = _perpetua("generate", "--preset", "tiny", "--rooms", "3", "--out", str(out), "--dry-run")
    assert done.exit_code == 0, done.output
    assert "3 room(s)" in done.output
    assert "6 frames x 4 views = 24 images of 64 x 48 px" in done.output
    assert str(out) in done.output.replace("\n", "")
    assert not out.exists()


def test_standard_is_the_default_preset(tmp_path: Path) -> None:
    done = _perpetua("generate", "--out", str(tmp_path / "out"), "--dry-run")
    assert "120 frames x 4 views = 480 images of 512 x 512 px" in done.output


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (("generate", "--preset", "tinny"), "did you mean 'tiny'?"),
        (("generate", "--until", "camera"), "did you mean 'cameras'?"),
        (("generate", "--set", "render.samples=-3"), "'render.samples' must be greater than or equal to 1"),
        (("generate", "--set", "render.sample=3"), "did you mean 'render.samples'?"),
        (("generate", "--config", "no-such-file.yaml"), "cannot read config 'no-such-file.yaml'"),
        (("generate", "--rooms", "0"), "0 is not in the range x>=1"),
        (("generate", "--seed", "-1"), "-1 is not in the range x>=0"),
        (("generate", "--device", "gpu"), "'gpu' is not one of"),
        (("status", "--out", "no-such-folder"), "holds no run of perpetua"),
        (("clean", "--out", "no-such-folder"), "holds no run of perpetua"),
        (("verify", "no-such-folder"), "no-such-folder"),
        (("preview", "no-such-folder"), "no-such-folder"),
        (("preview",), "preview needs one of: the folder of a sequence, --actors N, --rooms N"),
        (("preview", "--actors", "0"), "0 is not in the range x>=1"),
        (("preview", "--actors", "1", "--out", "sheet.gif"), "a picture must end in .png or .jpg, not 'sheet.gif'"),
    ],
)
def test_bad_input_gives_a_clear_error_and_exit_code_2(
    arguments: tuple[str, ...], expected: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    done = _perpetua(*arguments)
    assert done.exit_code == 2, done.output
    assert expected in done.output
    assert list(tmp_path.iterdir()) == []


def test_other_settings_do_not_overwrite_an_output_folder(tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    config = json.loads(_config_json())
    (out / "run.json").write_text(json.dumps({"seed": 7, "rooms": [0], "config": config}))
    done = _perpetua("generate", "--preset", "tiny", "--seed", "8", "--out", str(out))
    assert done.exit_code == 2
    assert "--seed 7, now 8" in done.output
    assert json.loads((out / "run.json").read_text())["seed"] == 7


def _config_json() -> str:
    from perpetua.config import load_config

    return load_config("tiny").model_dump_json()


def test_status_of_a_run_that_has_not_begun(tmp_path: Path) -> None:
    (tmp_path / "run.json").write_text(json.dumps({"seed": 7, "rooms": [0, 1], "config": json.loads(_config_json())}))
    done = _perpetua("status", "--out", str(tmp_path), "--json")
    report = json.loads(done.output)
    assert [room["state"] for room in report["rooms"]] == ["waiting", "waiting"]
    assert report["seconds_left"] is None


def test_assets_lists_licences() -> None:
    done = _perpetua("assets")
    assert done.exit_code == 0
    assert "infinigen" in done.output
    assert "smplx" in done.output


def test_doctor_names_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("perpetua.system_libraries._loads", lambda library: library != "libXi.so.6")
    done = _perpetua("doctor", "--out", str(tmp_path))
    assert done.exit_code == 1
    assert "apt-get install -y libxi6" in " ".join(done.output.split())
    refused = _perpetua("generate", "--preset", "tiny", "--out", str(tmp_path / "out"))
    assert refused.exit_code == 2
    assert "sudo apt-get install -y libxi6" in refused.output
    assert not (tmp_path / "out").exists()


def test_doctor_knows_the_packages_the_readme_names() -> None:
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    assert all(package in readme for package in SYSTEM_LIBRARIES.values())


def test_stage_names_follow_the_data_flow() -> None:
    assert STAGE_NAMES == (
        "room", "navigation", "routes", "motion", "actors", "cameras", "render", "tracks", "export", "audit",
    )  # fmt: skip
