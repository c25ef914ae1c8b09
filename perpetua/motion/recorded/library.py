"""A user's folder of clips, and which of them an action description asks for."""

import re
from functools import lru_cache
from pathlib import Path

import numpy as np
import yaml

from perpetua.errors import AssetError
from perpetua.motion.recorded.amass import read_amass
from perpetua.motion.recorded.bvh import read_bvh_clip
from perpetua.motion.recorded.clip import Clip

INDEX_FILE = "index.yaml"
_READERS = {".npz": read_amass, ".bvh": read_bvh_clip}
# Words that say nothing about what is done.
_IDLE_WORDS = frozenset(
    {"a", "an", "and", "at", "are", "her", "his", "in", "is", "it", "man", "of", "on", "person", "the", "their", "to"}
    | {"while", "with", "woman"}
)
_MOST_INDEX_BYTES = 2**22


def clip_files(folder: Path) -> dict[Path, frozenset[str]]:
    """The clips of a folder and its subfolders, in order of their names, with the words that describe each.

    A clip is described by its file name ("walk_phone_01.npz") and by what ``index.yaml`` says, a mapping of file names
    (relative to the folder) to a description or a list of descriptions.

    Raises:
        AssetError: there is no folder, no clip in it, or the index is not valid.
    """
    if not folder.is_dir():
        raise AssetError(
            f"actors.motion.clips.folder '{folder}' is no folder: put .npz or .bvh clips there or name another folder"
        )
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in _READERS and path.is_file())
    if not paths:
        raise AssetError(f"actors.motion.clips.folder '{folder}' holds no clips: .npz (AMASS, SMPL-X) or .bvh are read")
    told = _read_index(folder, paths)
    return {path: action_words(path.relative_to(folder).with_suffix("").as_posix()) | told[path] for path in paths}


def _read_index(folder: Path, paths: list[Path]) -> dict[Path, frozenset[str]]:
    told: dict[Path, frozenset[str]] = dict.fromkeys(paths, frozenset())
    index = folder / INDEX_FILE
    if not index.exists():
        return told
    try:
        if index.stat().st_size > _MOST_INDEX_BYTES:
            raise AssetError(f"'{index}' is larger than {_MOST_INDEX_BYTES} bytes")
        content = yaml.safe_load(index.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, yaml.YAMLError) as error:
        raise AssetError(f"cannot read '{index}': {error}") from None
    if not isinstance(content, dict):
        raise AssetError(f"'{index}' must map file names to descriptions, such as 'walk_01.npz: walks slowly'")
    for name, descriptions in content.items():
        lines = [descriptions] if isinstance(descriptions, str) else descriptions
        if folder / str(name) not in told:
            raise AssetError(f"'{index}' describes '{name}', which is not a clip in '{folder}'")
        if not isinstance(lines, list) or not all(isinstance(line, str) for line in lines):
            raise AssetError(f"'{index}': '{name}' must have a description or a list of descriptions")
        told[folder / str(name)] = action_words(" ".join(lines))
    return told


def action_words(text: str) -> frozenset[str]:
    """The stems of the words that say what is done: "WalkingSlowly_01" -> {"walk", "slow"}."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    words = re.findall(r"[a-z]+", spaced.lower())
    return frozenset(_stem(word) for word in words if word not in _IDLE_WORDS and len(word) > 1)


def _stem(word: str) -> str:
    for ending in ("ingly", "ing", "ely", "ly", "ies", "es", "ed", "s", "e"):
        if word.endswith(ending) and len(word) - len(ending) >= 3:
            return word.removesuffix(ending)
    return word


def ranked_clips(
    files: dict[Path, frozenset[str]], description: str, rng: np.random.Generator
) -> list[tuple[Path, ...]]:
    """Clips in groups that fit equally well, best first; the order within a group is drawn.

    A clip fits by how many of the description's words describe it, then by how few further words do.
    """
    wanted = action_words(description)
    groups: dict[tuple[int, int], list[Path]] = {}
    paths = list(files)
    for index in rng.permutation(len(paths)):
        words = files[paths[index]]
        shared = len(wanted & words)
        groups.setdefault((-shared, len(words - wanted) if shared > 0 else 0), []).append(paths[index])
    return [tuple(groups[fit]) for fit in sorted(groups)]


def load_clip(path: Path, up: str) -> Clip:
    """Reads a clip by its suffix; a file that has not changed is read once per process.

    Raises:
        AssetError: see ``read_amass`` and ``read_bvh_clip``.
    """
    try:
        stat = path.stat()
    except OSError as error:
        raise AssetError(f"cannot read '{path}': {error}") from None
    return _load_once(path, stat.st_mtime_ns, stat.st_size, up)


@lru_cache(maxsize=4)
def _load_once(path: Path, mtime_ns: int, size: int, up: str) -> Clip:
    return _READERS[path.suffix.lower()](path, up)
