"""Files that come with Perpetua and are no modules of it: Blender's scripts, presets and action lists, asset entries.

In the repository they are top-level folders, in an installed package they lie in this one (``setup.py`` maps them);
``importlib.resources`` finds them in both.
"""

from importlib.resources import files
from pathlib import Path

from perpetua.errors import EnvironmentSetupError


def _folder(name: str) -> Path:
    """The folder of one package of files.

    Raises:
        EnvironmentSetupError: it is not on disk, where other programs must be able to read it.
    """
    place = files(f"{__name__}.{name}")
    if not isinstance(place, Path):
        raise EnvironmentSetupError(
            f"the files of '{name}' must lie unpacked on disk, not in an archive: install perpetua with pip"
        )
    return place


SCRIPT_FOLDER = _folder("blender_scripts")
PRESET_FOLDER = _folder("configs") / "presets"
ACTION_FOLDER = _folder("configs") / "actions"
MANIFEST_FOLDER = _folder("assets_manifest")
