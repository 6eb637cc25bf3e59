"""A small robot with two arms and two grippers, and its node: in this process, or served by a thread of it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cellwright.config.robot.config import ArmConfig, GripperConfig, RobotConfig
from cellwright.config.robot.model import Inertial, Joint, JointType, Limits, Link, RobotModel
from cellwright.engine.loop import SimulationLoop
from cellwright.middleware.server import Server
from cellwright.robot.node import RobotNode
from cellwright.util.pose import Pose
from tests.support.waiting import TIMEOUT

_ARM = ((0.0, 0.0, 1.0), (0.0, 1.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def robot() -> RobotConfig:
    """Return a robot of two arms: six joints each within +-2 rad at 3 rad/s, and a gripper finger from 0 to 0.04 m."""
    links = [Link("base", Inertial(5.0))]
    joints: list[Joint] = []
    for side, y in (("right", -0.3), ("left", 0.3)):
        parent, origin = "base", Pose((0.0, y, 0.5))
        for number, axis in enumerate(_ARM, start=1):
            link = f"{side}_link_{number}"
            limits = Limits(-2.0, 2.0, effort=100.0, velocity=3.0)
            joints.append(Joint(f"{side}_{number}", JointType.REVOLUTE, parent, link, origin, axis, limits))
            links.append(Link(link, Inertial(0.5, Pose((0.05, 0.0, 0.0)), (0.01, 0.01, 0.01, 0.0, 0.0, 0.0))))
            parent, origin = link, Pose((0.15, 0.0, 0.0))
        joints.append(Joint(f"{side}_tip_fixed", JointType.FIXED, parent, f"{side}_tip", origin))
        finger = Limits(0.0, 0.04, effort=20.0, velocity=0.2)
        joints.append(
            Joint(f"{side}_finger", JointType.PRISMATIC, f"{side}_tip", f"{side}_pad", Pose(), (0, 1, 0), finger)
        )
        links += [Link(f"{side}_tip"), Link(f"{side}_pad", Inertial(0.1, Pose(), (1e-4, 1e-4, 1e-4, 0.0, 0.0, 0.0)))]
    model = RobotModel("two arms", "base", {link.name: link for link in links}, tuple(joints))
    home = (0.0, 0.6, -1.2, 0.0, 0.4, 0.0)
    sides = ("right", "left")
    return RobotConfig(
        model,
        "two arms",
        Path("two_arms.yml"),
        Path("two_arms.urdf"),
        arms=tuple(ArmConfig(tuple(f"{side}_{n}" for n in range(1, 7)), f"{side}_tip", home) for side in sides),
        grippers=tuple(GripperConfig((f"{side}_finger",)) for side in sides),
        command_links=tuple(f"{side}_tip" for side in sides),
        reference_links=(None, None),
    )


@contextmanager
def served(node: RobotNode, *, lockstep: bool = False) -> Iterator[tuple[str, int]]:
    """Yield the address of a served node, in real time or in lockstep."""
    server = Server(node, port=0, lockstep=lockstep)
    loop = SimulationLoop(node.simulation, server, timeout=TIMEOUT)
    thread = threading.Thread(target=loop.run)
    thread.start()
    try:
        yield server.address
    finally:
        loop.stop.request()
        thread.join(TIMEOUT)
        server.close("the test is over")
