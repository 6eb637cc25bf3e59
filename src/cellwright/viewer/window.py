"""Window of a robot, MuJoCo's own: a process that polls the robot's node and delays no step."""

import importlib.util
import os
import sys
import tempfile
from pathlib import Path

import mujoco

from cellwright.util.errors import CellwrightError
from cellwright.util.process import ChildProcess

HOW_TO_GET_IT = "run: pip install 'cellwright[gui]'"

_READY = "ready"
_TIME_TO_END = 0.7  # [s]


class WindowError(CellwrightError):
    """Error of a window that cannot open; the text says why and what to do."""


class Window(ChildProcess):
    """Window on a robot.

    Args:
        model: the model that it shows.
        address: address of the served node. It must answer `services.STATE`, and does so only once it runs.
        sliders: show a slider for each joint; a moved slider sends a target as any client does.

    Raises:
        WindowError: there is no display, or OpenGL support is not installed.
    """

    def __init__(self, model: mujoco.MjModel, address: tuple[str, int], *, sliders: bool) -> None:
        if reason := unavailable_reason():
            raise WindowError(reason)
        with tempfile.TemporaryDirectory(prefix="cellwright-") as folder:
            file = Path(folder) / "model.mjb"
            mujoco.mj_saveModel(model, str(file), None)
            command = [sys.executable, "-P", "-m", "cellwright.viewer.window_program"]
            super().__init__([*command, address[0], str(address[1]), str(file), "sliders" if sliders else ""])
            line = self.ready_line()
        if line != _READY:
            self.close()
            raise WindowError(line or "window cannot open: its process has ended")

    def close(self) -> None:
        """Close the window. It closes on its own when the node has ended, so it first gets a moment to do so."""
        self.end(_TIME_TO_END)


def unavailable_reason() -> str:
    """Return why no window can open here, in a sentence; empty where one may."""
    lacking = [name for name in ("glfw", "OpenGL") if importlib.util.find_spec(name) is None]
    if lacking:
        return f"window cannot open: {' and '.join(lacking)} not installed; {HOW_TO_GET_IT}"
    if sys.platform == "darwin":
        return "window cannot open: on macOS MuJoCo's window requires its own Python, mjpython; use --snapshot"
    if sys.platform == "linux" and not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        return "window cannot open: no display (DISPLAY is not set); use --snapshot, or run it on a desktop"
    return ""
