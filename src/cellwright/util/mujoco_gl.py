"""The variable MUJOCO_GL, which says how MuJoCo draws. Cellwright never has it draw, and needs no such library."""

import os
import sys
from ctypes.util import find_library

VARIABLE = "MUJOCO_GL"

_OWN = {"linux": "glx", "darwin": "cgl", "win32": "wgl"}  # each system's own way
_KNOWN = frozenset({"", "glfw", "enable", "enabled", "on", "true", "1", _OWN.get(sys.platform, "")})
_LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"} if sys.platform == "linux" else {}
_NONE = "disable"


def settle() -> None:
    """Set the variable to `disable` where its value would make the import of MuJoCo fail.

    MuJoCo fails on a value that it does not know, and on one whose library this machine lacks. It is then `disable` for
    processes that are started from here as well.
    """
    value = os.environ.get(VARIABLE, "").lower().strip()
    library = _LIBRARIES.get(value)
    can_load = value in _KNOWN if library is None else find_library(library) is not None
    if not can_load:
        os.environ[VARIABLE] = _NONE
