"""Process of a robot's window: `python -m cellwright.viewer.window_program HOST PORT MODEL [sliders]`.

It prints `ready` once the window is open, or a sentence that says why not. Then it shows the served robot, about sixty
times a second, until the window closes or the robot's node ends.
"""

from __future__ import annotations

import contextlib
import math
import signal
import sys
import threading
import time
from collections.abc import Sequence
from typing import Any

import mujoco
import numpy as np

from cellwright.clients.assembled import process
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.middleware.messages.conversions import joint_state
from cellwright.rendering.camera import Camera
from cellwright.robot.pictures import HEIGHT, TILT, TURN, WIDTH, camera_on
from cellwright.util.errors import CellwrightError, RejectedCommandError, RunEndedError
from cellwright.util.pose import Pose

NODE = "/window"
COMMANDS = "/io_teleop/joint_cmd"

_PERIOD = 1 / 60  # [s]
_AMBIENT, _DIFFUSE = 0.35, 0.7  # of the light at the eye: there is no other
_TIME_TO_CLOSE = 2.0  # [s]


def main(arguments: Sequence[str]) -> int:
    """Show a robot; return the exit status."""
    host, port, file, *more = arguments
    # Ctrl-C on the terminal is for the node; its end ends this process.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    model = mujoco.MjModel.from_binary_path(file)
    # Here, since it needs a system library that may be missing.
    import glfw

    glfw.ERROR_REPORTING = "ignore"
    if not glfw.init():
        reason: Any = glfw.get_error()[1]
        _print_line(f"window cannot open: {reason.decode(errors='replace') if isinstance(reason, bytes) else reason}")
        return 1
    _print_line("ready")
    try:
        transport = SocketTransport((host, int(port)), node=NODE)
        _show(model, transport, has_sliders="sliders" in more)
    except (CellwrightError, RunEndedError):
        pass  # the node has ended
    return 0


def _show(model: mujoco.MjModel, transport: SocketTransport, *, has_sliders: bool) -> None:
    from mujoco import viewer  # here, since it loads glfw

    data = mujoco.MjData(model)
    picture = RobotPicture(model, data)
    picture.take(transport.ask_server(process.STATE_SERVICE))
    model.vis.global_.fovy = math.degrees(picture.camera.fov)
    model.vis.headlight.ambient[:], model.vis.headlight.diffuse[:] = _AMBIENT, _DIFFUSE
    before = set(threading.enumerate())
    try:
        with viewer.launch_passive(model, data, show_left_ui=False, show_right_ui=has_sliders) as window:
            _keep_up(window, picture, transport)
    finally:
        for thread in set(threading.enumerate()) - before:
            # The process's end frees the window.
            thread.join(_TIME_TO_CLOSE)


def _keep_up(window: Any, picture: RobotPicture, transport: SocketTransport) -> None:
    """Show the robot and forward slider moves until the window closes."""
    with window.lock():
        picture.look_at_it(window.cam)
    while window.is_running():
        started_at = time.perf_counter()
        with window.lock():
            moved = picture.moved()
        if moved:
            # without a stamp, since the node's time may differ; a refused target shows as the slider going back
            with contextlib.suppress(RejectedCommandError):
                transport.publish(COMMANDS, joint_state(list(moved), np.array([*moved.values()]), time=0))
        state = transport.ask_server(process.STATE_SERVICE)
        with window.lock():
            picture.take(state)
        window.sync()
        time.sleep(max(0.0, _PERIOD - (time.perf_counter() - started_at)))


class RobotPicture:
    """Engine model posed as the robot's node reports; its joints and actuators have the names of the robot's joints."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        self._model, self._data = model, data
        self._names = [model.actuator(number).name for number in range(model.nu)]  # in the order of their indices
        self._places = [model.joint(name).qposadr[0] for name in self._names]
        self._targets = data.ctrl.copy()

    @property
    def camera(self) -> Camera:
        """Camera with the whole robot in its picture, as for `--snapshot`."""
        w, x, y, z = self._data.mocap_quat[0].tolist()
        heading = Pose(quaternion=(w, x, y, z)).yaw
        return camera_on(self._model, self._data, heading + TURN, TILT, WIDTH, HEIGHT)

    def look_at_it(self, view: mujoco.MjvCamera) -> None:
        """Put MuJoCo's own camera there."""
        camera = self.camera
        forward = np.subtract(camera.target, camera.eye)
        view.lookat[:], view.distance = camera.target, np.linalg.norm(forward)
        view.azimuth = math.degrees(math.atan2(forward[1], forward[0]))
        view.elevation = math.degrees(math.asin(forward[2] / view.distance))

    def moved(self) -> dict[str, float]:
        """Positions [rad; m] of the joints whose slider was moved since the last state."""
        sliders = self._data.ctrl
        return {self._names[number]: float(sliders[number]) for number in np.flatnonzero(sliders != self._targets)}

    def take(self, state: dict[str, Any]) -> None:
        """Show a state, as `services.STATE` answers it."""
        data = self._data
        data.qpos[self._places] = state["driven"]
        data.mocap_pos[0], data.mocap_quat[0] = state["carrier"][:3], state["carrier"][3:]
        self._targets[:] = data.ctrl[:] = state["targets"]
        mujoco.mj_forward(self._model, data)


def _print_line(line: str) -> None:
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
