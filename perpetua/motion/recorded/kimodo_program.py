"""Kimodo as a program of its own, started once for each request; what it made is kept."""

import contextlib
import hashlib
import json
import os
import shlex
import shutil
import signal
import subprocess
import tempfile
from pathlib import Path

from perpetua.errors import AssetError
from perpetua.io.files import file_sha256
from perpetua.machine.assets import asset_folder
from perpetua.motion.config import KimodoConfig
from perpetua.motion.recorded.clip import Clip
from perpetua.motion.recorded.kimodo_files import SUPPORTED, TRANSITION_FRAMES, KimodoRequest, read_result

_STEM = "motion"
_RESULTS = (f"{_STEM}.npz", f"{_STEM}_amass.npz")
_QUOTED_CHARACTERS = 2000


def generate(request: KimodoRequest, config: KimodoConfig, seed: int) -> Clip:
    """What Kimodo makes of a request, from the cache if it has made it before.

    Args:
        request: prompts, durations and path.
        config: the program, its model and limits.
        seed: Kimodo's own seed, >= 0.

    Raises:
        AssetError: the program is missing, fails, takes too long, or what it wrote cannot be used.
    """
    program = kimodo_program(config)
    kept = asset_folder() / "cache" / "kimodo" / _key(request, config, seed, program)
    if kept.is_dir():
        with contextlib.suppress(AssetError):
            return read_result(kept, _STEM, request)
    with tempfile.TemporaryDirectory(prefix="perpetua_kimodo_") as folder:
        _run(request, config, seed, program, Path(folder))
        clip = read_result(Path(folder), _STEM, request)
        _keep(Path(folder), kept)
    return clip


def kimodo_program(config: KimodoConfig) -> list[str]:
    """The program's path and the arguments that the config gives it.

    Raises:
        AssetError: it is not on this machine, or its model moves no people.
    """
    if "g1" in config.model.lower():
        raise AssetError(f"actors.motion.kimodo.model '{config.model}' makes motion of a robot; {SUPPORTED}")
    words = shlex.split(config.program)
    found = shutil.which(words[0]) if words else None
    if found is None:
        raise AssetError(
            f"actors.motion.kimodo.program '{config.program}' is not a program on this machine: install Kimodo "
            "(https://github.com/nv-tlabs/kimodo), name its path, or choose another actors.motion.source"
        )
    return [found, *words[1:]]


def _key(request: KimodoRequest, config: KimodoConfig, seed: int, program: list[str]) -> str:
    """Everything that the result depends on; a program's own file stands for its version, with what the config says."""
    content = {
        "prompt": request.prompt,
        "durations": request.durations,
        "constraints": request.constraints(),
        "model": config.model,
        "seed": seed,
        "transition_frames": TRANSITION_FRAMES,
        "program": [file_sha256(Path(program[0])), *program[1:]],
        "version": config.version,
    }
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _run(request: KimodoRequest, config: KimodoConfig, seed: int, program: list[str], folder: Path) -> None:
    constraints = folder / "constraints.json"
    constraints.write_text(request.constraints(), encoding="utf-8")
    command = [
        *program,
        request.prompt,
        *("--model", config.model),
        *("--duration", request.durations),
        *("--constraints", str(constraints)),
        *("--output", str(folder / _STEM)),
        *("--num_transition_frames", str(TRANSITION_FRAMES)),
        *("--seed", str(seed)),
    ]
    try:
        # A session of its own, so that all it started can be ended with it.
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)
    except OSError as error:
        raise AssetError(f"cannot start Kimodo '{program[0]}': {error}") from None
    try:
        output, _ = process.communicate(timeout=config.timeout_s)
    except subprocess.TimeoutExpired:
        _end(process)
        raise AssetError(
            f"Kimodo took longer than {config.timeout_s:g} s for {sum(request.frames)} frames: "
            "raise actors.motion.kimodo.timeout_s, or check that it runs on a GPU"
        ) from None
    except BaseException:
        _end(process)
        raise
    if process.returncode != 0:
        raise AssetError(_failure(process.returncode, output.decode(errors="replace")))


def _end(process: "subprocess.Popen[bytes]") -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def _failure(code: int, output: str) -> str:
    said = output.strip()[-_QUOTED_CHARACTERS:]
    if "unrecognized arguments" in output or "the following arguments are required" in output:
        return f"Kimodo does not know how it is called; version 1 is needed. It said:\n{said}"
    return f"Kimodo failed with exit code {code}. It said:\n{said}"


def _keep(folder: Path, kept: Path) -> None:
    """Puts results into the cache, whole or not at all; whoever comes first wins, as all make the same."""
    try:
        kept.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".partial_", dir=kept.parent) as partial:
            whole = Path(partial) / "result"
            whole.mkdir()
            for name in _RESULTS:
                if (folder / name).exists():
                    shutil.copyfile(folder / name, whole / name)
            if kept.is_dir():
                # What is there could not be read: it makes way.
                kept.rename(Path(partial) / "damaged")
            whole.rename(kept)
    except OSError as error:
        if not kept.is_dir():
            raise AssetError(f"cannot keep Kimodo's result in '{kept}': {error}") from None
