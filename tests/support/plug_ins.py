"""Installed packages that offer plug-ins: what pip leaves of one, without pip."""

from collections.abc import Mapping
from pathlib import Path


def install(folder: Path, name: str, version: str, points: Mapping[str, Mapping[str, str]], code: str = "") -> None:
    """Puts a package of one module into a folder that is, or will be, on ``sys.path``.

    Args:
        folder: takes the module ``NAME`` and the folder with its metadata.
        name: of the package and, with underscores, of its module.
        version: of the package.
        points: by group, name -> "module:object".
        code: what the module holds.
    """
    metadata = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    lines = [f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in named.items()) for group, named in points.items()]
    (metadata / "entry_points.txt").write_text("\n".join(lines))
    (folder / f"{name.replace('-', '_')}.py").write_text(code)
