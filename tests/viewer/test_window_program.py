"""Program of the window on a robot: its picture, its view, and what its sliders send."""

import math
import threading
from contextlib import AbstractContextManager, nullcontext

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
from cellwright.viewer.window_program import NODE, RobotPicture, _keep_up
from tests.robot.robots import two_arms


@pytest.fixture(scope="module")
def node() -> RobotNode:
    return RobotNode(two_arms())


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
