"""Window on a robot: reasons against it, its content, and a real one on a virtual display."""

import importlib.util
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.clients.assembled.process import STATE_SERVICE
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode
from cellwright.robot.services import RobotServices
from cellwright.viewer.window import Window, WindowError, unavailable_reason
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
