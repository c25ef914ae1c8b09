"""The command line as a user meets it."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

import perpetua
from perpetua.cli.app import main
from perpetua.machine.system_libraries import SYSTEM_LIBRARIES
from perpetua.pipeline.stages import STAGE_NAMES
from tests.support.paths import ROOT


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


def test_the_package_is_the_program(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", "perpetua", "status", "none"], cwd=tmp_path, capture_output=True)
    assert done.returncode == 2 and b"perpetua: 'none' holds no run" in done.stderr


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
        (("generat",), "No such command 'generat'. Did you mean 'generate'?"),
        (("--preset", "tiny"), "'--preset' comes after a command, for example: perpetua generate --preset"),
        (("--sed", "1"), "No such option '--sed'"),
        (("generate", "--preset", "tinny"), "did you mean 'tiny'?"),
        (("generate", "--preset", "Tiny"), "must be one of tiny, quick, standard, benchmark, not 'Tiny'; did you mean"),
        (("generate", "--until", "camera"), "did you mean 'cameras'?"),
        (("generate", "--set", "render.samples=-3"), "'render.samples' must be greater than or equal to 1"),
        (("generate", "--set", "render.sample=3"), "did you mean 'render.samples'?"),
        (("generate", "--config", "no-such-file.yaml"), "cannot read config 'no-such-file.yaml'"),
        (("generate", "--set", "actors.body=smpl"), "did you mean 'smplx'?"),
        (("generate", "--set", "actors.body=smplx"), "needs SMPLX_MALE.npz or SMPLX_NEUTRAL.npz in"),
        (("generate", "--set", "actors.clothing.source=makehuman"), "must hold MakeHuman garments"),
        (("generate", "--set", "actors.motion.source=clip"), "did you mean 'clips'?"),
        (("generate", "--set", "actors.motion.source=clips"), "actors.motion.clips.folder"),
        (("generate", "--set", "actors.motion.source=kimodo"), "is not a program on this machine"),
        (("generate", "--set", "actors.motion.actions=evryday"), "actors.motion.actions must be one of"),
        (("generate", "--config", "."), "must be a file of YAML"),
        (("generate", "--out", "/dev/null/out"), "cannot be a folder, as '/dev/null' is a file"),
        (("generate", "--rooms", "0"), "must be 1 or more, not 0"),
        (("generate", "--rooms", "two"), "must be a whole number, not 'two'"),
        (("generate", "--seed", "-1"), "must be 0 or more, not -1"),
        (("generate", "--device", "gpu"), "'gpu' is not one of"),
        (("config", "render"), "unexpected extra argument (render)"),
        (("completion", "tcsh"), "'tcsh' is not one of 'bash', 'zsh', 'fish'"),
        (("status", "no-such-folder"), "holds no run of perpetua"),
        (("clean", "no-such-folder"), "holds no run of perpetua"),
        (("verify", "no-such-folder"), "'no-such-folder' does not exist"),
        (("verify", "."), "'.' holds no sequence"),
        (("preview", "no-such-folder"), "'no-such-folder' does not exist; the folder of a sequence is required"),
        (("preview", "."), "'.' is not the folder of a sequence: it has no tracks_xyz.npy"),
        (("tracks", ".", "--out", "more"), "'.' is not the folder of a sequence"),
        (("preview",), "preview needs one of: the folder of a sequence, --actors N, --rooms N"),
        (("preview", "--actors", "0"), "must be 1 or more, not 0"),
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


def test_an_outer_folder_leads_to_the_sequence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    sequence = Path("data/train/seed7-room0000")
    sequence.mkdir(parents=True)
    (sequence / "tracks_xyz.npy").touch()
    done = _perpetua("preview", "data")
    assert done.exit_code == 2
    assert f"did you mean '{sequence}'?" in done.output


def test_a_folder_that_takes_no_files_is_said_before_the_work(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.access", lambda place, mode: False)
    done = _perpetua("generate", "--preset", "tiny", "--out", str(tmp_path / "out"), "--dry-run")
    assert done.exit_code == 2
    assert f"you may not write to '{tmp_path}'" in done.output


@pytest.mark.parametrize(
    ("error", "code"), [(FileNotFoundError(2, "No such file", "x.png"), 2), (OSError(28, "No space left", "x.png"), 1)]
)
def test_what_the_system_refuses_is_no_traceback(
    error: OSError, code: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> None:
        raise error

    monkeypatch.setattr("perpetua.pipeline.status.read_status", refuse)
    done = _perpetua("status", str(tmp_path))
    assert done.exit_code == code
    assert done.output == f"perpetua: cannot use 'x.png': {error.strerror}\n"


def test_help_lists_every_command_whole() -> None:
    shown = _perpetua("--help").output.partition("Options:")[2]
    assert "..." not in shown
    assert all(f"\n  {name} " in shown for name in main.commands)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_scripts_ask_the_program(shell: str) -> None:
    done = _perpetua("completion", shell)
    assert done.exit_code == 0
    assert f"_PERPETUA_COMPLETE={shell}_complete" in done.output


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("perpetua gen", "generate"),
        ("perpetua generate --pre", "--preset"),
        ("perpetua generate --preset ti", "tiny"),
        ("perpetua generate --until cam", "cameras"),
        ("perpetua generate --set render.sam", "render.samples="),
    ],
)
def test_shells_complete_what_is_typed(words: str, offered: str) -> None:
    typed = {"_PERPETUA_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    done = CliRunner().invoke(main, env=typed, prog_name="perpetua")
    assert offered in [line.partition(",")[2] for line in done.output.splitlines()]


def test_config_reads_what_it_writes(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(_perpetua("config", "--preset", "quick", "--set", "actors.count=3").output)
    assert "  count: 3  # actors in a room" in _perpetua("config", "--preset", "quick", "--config", str(mine)).output


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
    done = _perpetua("status", str(tmp_path), "--json")
    report = json.loads(done.output)
    assert [room["state"] for room in report["rooms"]] == ["waiting", "waiting"]
    assert report["seconds_left"] is None


def test_sequences_of_another_version_are_named_and_kept(tmp_path: Path) -> None:
    from perpetua.config import load_config
    from perpetua.errors import InputError
    from perpetua.pipeline.layout import RunLayout
    from perpetua.pipeline.room_work import GenerateRequest
    from perpetua.runs.generate import open_folder

    (tmp_path / "run.json").write_text(json.dumps({"seed": 7, "rooms": [0, 1], "config": json.loads(_config_json())}))
    sequence = RunLayout(tmp_path, load_config("tiny").export, 7).room(1).sequence_folder
    sequence.mkdir(parents=True)
    (sequence / "audit.json").write_text(json.dumps({"key": "another", "rejected_draws": 0}))
    report = json.loads(_perpetua("status", str(tmp_path), "--json").output)
    assert [room["state"] for room in report["rooms"]] == ["waiting", "outdated"]
    assert "--replace would make it anew" in _perpetua("status", str(tmp_path)).output
    again = ("generate", "--preset", "tiny", "--seed", "7", "--out", str(tmp_path))
    done = _perpetua(*again, "--rooms", "2")
    assert done.exit_code == 2 and f"'{sequence}' is not what this version" in done.output.replace("\n", " ")
    assert [path.name for path in sequence.iterdir()] == ["audit.json"]
    assert json.loads((tmp_path / "run.json").read_text())["rooms"] == [0, 1]
    request = GenerateRequest(load_config("tiny"), 7, range(3), None, tmp_path, 1, "cpu", replace=False)
    with pytest.raises(InputError, match="pass --replace"):
        open_folder(request)
    assert json.loads((tmp_path / "run.json").read_text())["rooms"] == [0, 1]
    open_folder(replace(request, replace=True))
    assert json.loads((tmp_path / "run.json").read_text())["rooms"] == [0, 1, 2]


def test_assets_lists_licences() -> None:
    done = _perpetua("assets")
    assert done.exit_code == 0
    assert "infinigen" in done.output
    assert "smplx" in done.output


def test_doctor_names_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("perpetua.machine.system_libraries._loads", lambda library: library != "libXi.so.6")
    done = _perpetua("doctor", "--out", str(tmp_path))
    assert done.exit_code == 1
    assert "apt-get install -y libxi6" in " ".join(done.output.split())
    refused = _perpetua("generate", "--preset", "tiny", "--out", str(tmp_path / "out"))
    assert refused.exit_code == 2
    assert "sudo apt-get install -y libxi6" in refused.output
    assert not (tmp_path / "out").exists()


def test_doctor_knows_the_packages_the_readme_names() -> None:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert all(package in readme for package in SYSTEM_LIBRARIES.values())


def test_stage_names_follow_the_data_flow() -> None:
    assert STAGE_NAMES == (
        "room", "navigation", "routes", "motion", "actors", "cameras", "render", "tracks", "export", "audit",
    )  # fmt: skip
