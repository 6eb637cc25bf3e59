"""Window on a robot: reasons against it, its content, and a real one on a virtual display."""

import importlib.util
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import mujoco
import numpy as np
import pytest

from cellwright.clients.assembled.process import STATE_SERVICE
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.safety import SafetySettings
from cellwright.robot.services import RobotServices
from cellwright.util.pose import Pose
from cellwright.viewer.window import Window, WindowError, unavailable_reason
from cellwright.viewer.window_program import NODE, RobotPicture, _keep_up
from tests.robot.robots import two_arms
from tests.support.waiting import wait_until


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(two_arms())


@pytest.fixture
def display(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Virtual display."""
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdout is not None
    monkeypatch.setenv("DISPLAY", f":{process.stdout.readline().decode().strip()}")
    yield
    process.terminate()
    process.wait()
    process.stdout.close()


def test_window_without_display_is_refused(monkeypatch: pytest.MonkeyPatch, node: RobotNode) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(importlib.util, "find_spec", lambda _name: object())
    assert "no display" in unavailable_reason()
    with pytest.raises(WindowError, match="no display"):
        Window(node.world.model, ("127.0.0.1", 1), sliders=False)


def test_window_without_glfw_is_refused_with_install_hint(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None if name == "glfw" else object())
    assert unavailable_reason().startswith("window cannot open: glfw not installed; run: pip install 'cellwright[gui]'")


def test_robot_picture_has_pose_and_slider_moves_of_robot(node: RobotNode) -> None:
    node.simulation.reset()
    services = RobotServices(node)
    node.base.place(Pose((1.0, 2.0, 0.5)))
    node.commander.set_targets([node.commander.numbers["lift"]], [0.3])
    for _ in range(240):
        node.simulation.step()
    data = mujoco.MjData(node.world.model)
    picture = RobotPicture(node.world.model, data)
    picture.take(services.state({}))
    node.simulation.refresh()
    np.testing.assert_allclose(data.xpos, node.simulation.data.xpos, atol=1e-9)
    assert picture.moved() == {}
    data.ctrl[node.world.model.actuator("head").id] = 0.7
    assert picture.moved() == {"head": 0.7}
    targets = list(services.state({})["targets"])
    targets[node.world.model.actuator("head").id] = 0.7
    picture.take(services.state({}) | {"targets": targets})
    assert picture.moved() == {}, "the node has taken it"
    picture.take(services.state({}))
    assert picture.moved() == {}, "the robot moves them too"


def test_first_view_looks_at_robot_from_its_camera(node: RobotNode) -> None:
    data = mujoco.MjData(node.world.model)
    picture = RobotPicture(node.world.model, data)
    picture.take(RobotServices(node).state({}))
    view, camera = mujoco.MjvCamera(), picture.camera
    picture.look_at_it(view)
    azimuth, elevation = math.radians(view.azimuth), math.radians(view.elevation)
    level = math.cos(elevation)
    forward = np.array([level * math.cos(azimuth), level * math.sin(azimuth), math.sin(elevation)])
    np.testing.assert_allclose(view.lookat - view.distance * forward, camera.eye, atol=1e-6)


class Unseen:
    """Window without a display: its sliders take one value per update."""

    def __init__(self, data: mujoco.MjData, slider: int, values: list[float]) -> None:
        self.cam = mujoco.MjvCamera()
        self._data, self._slider, self._values = data, slider, values
        self.shown: list[float] = []

    def lock(self) -> AbstractContextManager[None]:
        return nullcontext()

    def is_running(self) -> bool:
        if self._values:
            self._data.ctrl[self._slider] = self._values.pop(0)
            return True
        return False

    def sync(self) -> None:
        self.shown.append(float(self._data.ctrl[self._slider]))


def test_slider_with_refused_target_goes_back_and_window_stays() -> None:
    node = RobotNode(two_arms(), RobotSettings(sim_time=True, safety=SafetySettings(start_guard=0.2, max_age=1.0)))
    server = Server(node, port=0)
    RobotServices(node).offer_state(server)
    loop = SimulationLoop(node.simulation, server)
    thread = threading.Thread(target=loop.run)
    thread.start()
    data, slider = mujoco.MjData(node.world.model), node.world.model.actuator("head").id
    picture, transport = RobotPicture(node.world.model, data), SocketTransport(server.address, node=NODE)
    try:
        picture.take(transport.ask_server(STATE_SERVICE))
        window = Unseen(data, slider, [1.0, 0.1, 0.1])
        _keep_up(window, picture, transport)
    finally:
        loop.stop.request()
        thread.join()
        transport.close()
        server.close("it is over")
        node.close()
    assert window.shown[0] == 0.0, "the guard refuses it"
    assert window.shown[-1] == 0.1, "no stamp of another clock is in its way"


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.usefixtures("display")
def test_window_opens_and_ends_with_its_node(capfd: pytest.CaptureFixture[str]) -> None:
    node = RobotNode(two_arms())
    server = Server(node, port=0)
    requests: list[Any] = []
    services = RobotServices(node)

    def state(values: dict[str, Any]) -> dict[str, Any]:
        requests.append(values)
        return services.state(values)

    server.offer(STATE_SERVICE, state)
    shown = Window(node.world.model, server.address, sliders=True)
    loop = SimulationLoop(node.simulation, server)
    wait_until(lambda: len(requests) > 20 or not shown.is_running, "questions of the window", between=loop.tick)
    assert shown.is_running, capfd.readouterr().err
    os.kill(shown._process.pid, signal.SIGSTOP)
    for _ in range(24):
        loop.tick()  # physics does not wait for the window
    os.kill(shown._process.pid, signal.SIGCONT)
    answered = len(requests)
    wait_until(lambda: len(requests) > answered, "more questions of the window", between=loop.tick)
    server.close("it is over")
    wait_until(lambda: not shown.is_running, "end of the window")
    shown.close()
    node.close()
    assert capfd.readouterr().err == ""


@pytest.mark.slow
@pytest.mark.display
@pytest.mark.usefixtures("display")
def test_window_on_missing_display_is_refused(monkeypatch: pytest.MonkeyPatch, node: RobotNode) -> None:
    monkeypatch.setenv("DISPLAY", ":54321")
    with pytest.raises(WindowError, match=r"^window cannot open: .*54321|^window cannot open: X11"):
        Window(node.world.model, ("127.0.0.1", 1), sliders=False)
