"""The variable MUJOCO_GL, which selects MuJoCo's OpenGL library. Cellwright never lets MuJoCo draw, and needs none."""

import os
import sys
from ctypes.util import find_library

VARIABLE = "MUJOCO_GL"

_OWN = {"linux": "glx", "darwin": "cgl", "win32": "wgl"}  # the backend of each system
_KNOWN = frozenset({"", "glfw", "enable", "enabled", "on", "true", "1", _OWN.get(sys.platform, "")})
_LIBRARIES = {"egl": "EGL", "osmesa": "OSMesa"} if sys.platform == "linux" else {}
_NONE = "disable"


def settle() -> None:
    """Set the variable to `disable` if its value would make the import of MuJoCo fail.

    MuJoCo fails on an unknown value, and on one whose library this machine lacks. The change also holds for processes
    that this one starts.
    """
    value = os.environ.get(VARIABLE, "").lower().strip()
    library = _LIBRARIES.get(value)
    can_load = value in _KNOWN if library is None else find_library(library) is not None
    if not can_load:
        os.environ[VARIABLE] = _NONE
