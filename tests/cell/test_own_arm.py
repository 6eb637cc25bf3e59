"""A cell with an arm of another model: it follows trajectories, picks and places, in lockstep and again."""

import math
from contextlib import closing

import pytest

from cellwright import Cell, Client
from cellwright.config.layout.arm_models import home_of
from cellwright.mechanism.solvers import solver_of
from cellwright.motion.chain import chain_of
from cellwright.motion.solver import Solver
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.cell.arm_cells import PEDESTAL, ur5_cell

PRESS = 0.0135
"""Height of the cup's face over a gear's origin, 1 mm below its top [m]."""


class Worker:
    """Program that moves the tool of a cell's arm, pointing down."""

    def __init__(self, cell: Cell) -> None:
        self.cell, self.client = cell, Client.in_process(cell)
        (arm,) = cell.trial.arms
        model = cell.trial.arm_models[arm.name]
        chain = chain_of(model.robot, arm.tip, tip_T_tool=Pose((0.0, 0.0, arm.tool.length)))
        home = home_of(arm, cell.trial.joints)
        self.solver: Solver = solver_of(chain, [home[joint.name] for joint in chain.joints])
        self.base_T_world = (arm.pose @ model.mount_T_root).inverse()
        self.worst = 0.0

    def go(self, x: float, y: float, z: float, duration: float) -> None:
        """Move the face of the cup to a point [m] in a time [s], and watch the error of the joints [rad]."""
        target = self.base_T_world @ Pose.from_rpy((x, y, z), (math.pi, 0.0, 0.0))
        present = self.client.joint_positions
        near = [present[name] for name in self.solver.joints]
        posture = next(iter(self.solver.branches(target, near)))
        still = [0.0] * len(posture)
        self.client.send_arm(
            [near, posture], [0.1, duration + 0.1], velocities=[still, still], joints=self.solver.joints
        )
        arm = self.cell.arm
        assert arm is not None
        for _ in range(round((duration + 0.3) * 50)):
            self.client.sleep(0.02)
            error = max(map(abs, arm.following().error[0]))
            self.worst = max(self.worst, error)


def work() -> tuple[float, str | None, str]:
    """Bring a gear from the bin over the tray; return the largest error, the held part and the state hash."""
    worker = Worker(Cell(ur5_cell()))
    cell, client = worker.cell, worker.client
    client.start_competition()
    client.sleep(0.5)
    x, y, z = cell.parts.pose(cell.parts.part("bin1|gear_part_1")).position
    worker.go(x, y, z + 0.1, 1.5)
    client.control_gripper(True)
    worker.go(x, y, z + PRESS, 1.0)
    worker.go(x, y, z + 0.25, 1.0)
    worker.go(-0.1, -0.55, 0.7, 2.0)
    assert cell.gripper is not None
    held = cell.gripper.part
    client.control_gripper(False)
    client.sleep(1.0)
    return worker.worst, held, cell.simulation.state_hash()


def test_ur5_on_a_pedestal_carries_a_part_within_10_mrad_and_twice_alike() -> None:
    first, second = work(), work()
    worst, held, _ = first
    assert held == "bin1|gear_part_1"
    assert worst < 0.010
    assert first == second


def test_messages_have_the_joints_and_links_of_the_model() -> None:
    cell = Cell(ur5_cell())
    client = Client.in_process(cell)
    client.sleep(0.1)
    assert [*client.joint_positions] == [*sorted(cell.trial.joints), "vacuum_gripper_joint"]


def test_reset_begins_in_other_joints_within_the_models_limits() -> None:
    cell = Cell(ur5_cell())
    cell.reset(joints={"elbow_joint": 1.0})
    assert cell.arm is not None
    assert cell.arm.read().positions[2] == pytest.approx(1.0)
    with pytest.raises(UsageError, match=r"elbow_joint must be within the joint's limits"):
        cell.reset(joints={"elbow_joint": 9.0})


def test_servo_profile_of_2017_is_refused_for_another_arm() -> None:
    with pytest.raises(UsageError, match="servo: precise is of the UR10 of 2017"):
        Cell(ur5_cell(), servo="precise")


def test_arm_without_a_cup_has_no_gripper_and_moves() -> None:
    trial = ur5_cell(PEDESTAL.replace("tip: tool0", "tip: tool0\n      tool: {{kind: none}}"))
    cell = Cell(trial)
    client = Client.in_process(cell)
    client.sleep(0.1)
    assert cell.gripper is None
    assert [*client.joint_positions] == sorted(trial.joints)
    assert not [name for name in cell.topics() if "gripper" in name]


def test_camera_is_fixed_to_a_link_of_the_model() -> None:
    eye = "{{type: rgb_camera, frame: wrist_3_link, pose: {{xyz: [0, 0, 0.1]}}, width: 64, height: 48}}"
    cell = Cell(ur5_cell(f"{PEDESTAL}cellwright: {{{{sensors: {{{{eye: {eye}}}}}}}}}"))
    client = Client.in_process(cell)
    frames = client.latest("/tf_static")
    with closing(cell.simulation):
        picture = client.camera("eye").wait(5.0)
    assert picture is not None
    assert picture.colour.shape == (48, 64, 3)
    parents = {each.child_frame_id: each.header.frame_id for each in frames.message.transforms}
    assert parents["eye_frame"] == "wrist_3_link"
