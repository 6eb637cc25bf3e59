"""Arms for tests of solvers: chains of `tests/data/arms`, of pybullet's data, and of published lengths."""

import math
import random
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import strategies as st

from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.urdf import read_urdf
from cellwright.config.ur10 import UR10, WRIST_3_T_TOOL
from cellwright.motion.chain import Chain, ChainJoint, ChainLink, chain_of
from cellwright.motion.ur import UrConstants, ur_links
from cellwright.util.pose import Pose

ARMS = Path(__file__).parents[1] / "data" / "arms"


class Arm(NamedTuple):
    """A chain and a good home of it [rad]."""

    chain: Chain
    home: tuple[float, ...]


_XARM7_HOME = (0.0, 0.3, 0.0, 1.2, 0.0, 0.9, 0.0)
UR_HOME = (0.0, -1.2, 1.6, -2.0, -1.57, 0.0)
_TIPS = {"ur5": "tool0", "xarm7": "link7"}
_PYBULLET: dict[str, tuple[str, str, tuple[float, ...]]] = {
    "panda": ("franka_panda/panda.urdf", "panda_hand", (0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785)),
    "iiwa7": ("kuka_iiwa/model.urdf", "lbr_iiwa_link_7", (0.0, 0.6, 0.0, -1.4, 0.0, 1.1, 0.0)),
    "xarm6": ("xarm/xarm6_robot.urdf", "link6", (0.0, 0.3, -1.2, 0.0, 0.9, 0.0)),
}


def robot(name: str) -> RobotModel:
    """Return a robot of `tests/data/arms`."""
    return read_urdf(ARMS / f"{name}.urdf", warn=lambda _: None)


@cache
def arm(name: str) -> Arm:
    """Return an arm by name; a test that needs one of pybullet's is skipped where that is not installed."""
    if name == "ur10":
        return Arm(chain_of(UR10, "wrist_3_link", base="base_link", tip_T_tool=WRIST_3_T_TOOL["tool0"]), UR_HOME)
    if name in _TIPS:
        return Arm(chain_of(robot(name), _TIPS[name]), UR_HOME if name.startswith("ur") else _XARM7_HOME)
    path, tip, home = _PYBULLET[name]
    data = Path(pytest.importorskip("pybullet_data").getDataPath())
    return Arm(chain_of(read_urdf(data / path, warn=lambda _: None), tip), home)


def ur_chain(ur: UrConstants, limit: float = 2.0 * math.pi) -> Chain:
    """Return the chain of an arm with published lengths, in the frames of the descriptions of ROS 1."""
    links = ur_links(ur, Pose(), (0.0,) * 6)
    axes = ((0.0, 0.0, 1.0), *((0.0, 1.0, 0.0),) * 3, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    joints = tuple(
        ChainJoint(name, pose.rotate(axis), pose.position, lower=-limit, upper=limit, speed=3.0)
        for (name, pose), axis in zip(links.items(), axes, strict=True)
    )
    tool = links["wrist_3_link"] @ Pose.from_rpy((0.0, ur.d6, 0.0), (-math.pi / 2, 0.0, 0.0))
    return Chain(joints, tool, {name: ChainLink(place + 1, pose) for place, (name, pose) in enumerate(links.items())})


def within(chain: Chain, limit: float = math.pi) -> st.SearchStrategy[tuple[float, ...]]:
    """Return postures of a chain within its limits, and within `limit` to either side."""
    return st.tuples(
        *(st.floats(max(joint.lower, -limit), min(joint.upper, limit), allow_subnormal=False) for joint in chain.joints)
    )


def error(chain: Chain, q: tuple[float, ...], base_T_tool: Pose) -> float:
    """Return how far the tool is from a pose: the larger of distance [m] and angle [rad]."""
    apart = base_T_tool.relative(chain.tool(q))
    _, x, y, z = apart.quaternion
    return max(math.hypot(*apart.position), 2.0 * math.asin(min(1.0, math.hypot(x, y, z))))


def straight_paths(chain: Chain, home: tuple[float, ...]) -> Iterator[list[Pose]]:
    """Yield 20 straight paths of 20 poses of the tool, up to 0.2 m from home along each axis."""
    rng = random.Random(3)
    start = chain.tool(home)
    for _ in range(20):
        goal = [each + rng.uniform(-0.2, 0.2) for each in start.position]
        poses = []
        for share in (place / 20 for place in range(1, 21)):
            x, y, z = (a + (b - a) * share for a, b in zip(start.position, goal, strict=True))
            poses.append(Pose((x, y, z), start.quaternion))
        yield poses
