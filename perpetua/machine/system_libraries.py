"""The system libraries that bpy links and its wheel does not bring."""

import ctypes
import platform

from perpetua.errors import EnvironmentSetupError

# The libraries that bpy 4.2 links and its wheel does not bring: file -> Debian and Ubuntu package.
SYSTEM_LIBRARIES = {
    "libGL.so.1": "libgl1",
    "libXi.so.6": "libxi6",
    "libXrender.so.1": "libxrender1",
    "libXxf86vm.so.1": "libxxf86vm1",
    "libXfixes.so.3": "libxfixes3",
    "libxkbcommon.so.0": "libxkbcommon0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
    "libgomp.so.1": "libgomp1",
}


def missing_libraries() -> list[str]:
    """Debian names of the system libraries that bpy needs and the loader does not find."""
    if platform.system() != "Linux":
        return []
    return [package for library, package in SYSTEM_LIBRARIES.items() if not _loads(library)]


def require_libraries() -> None:
    """Raises EnvironmentSetupError with the command to run if a system library of bpy is missing."""
    missing = missing_libraries()
    if missing:
        raise EnvironmentSetupError(
            f"Blender needs system libraries that are not installed: {', '.join(missing)}; on Debian or Ubuntu run: "
            f"sudo apt-get install -y {' '.join(missing)}"
        )


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
