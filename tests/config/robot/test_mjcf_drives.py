import math
from pathlib import Path

import pytest

from cellwright.config.robot.mjcf import MjcfRobot, read_mjcf
from cellwright.config.robot.mjcf_drives import JointDynamics, PositionDrive
from cellwright.config.robot.model import Mimic
from cellwright.util.errors import DescriptionError
from tests.config.robot.mjcf_robots import write

BODY = '<body><joint name="{0}" axis="{1}" {2}/><geom size="0.1"/></body>'
HAND = '<tendon><fixed name="both"><joint joint="a" coef="0.5"/><joint joint="b" coef="0.5"/></fixed></tendon>'
FOLLOWS = '<equality><joint joint1="b" joint2="a"/></equality>'


def read(folder: Path, after: str, a: str = "", b: str = "") -> tuple[MjcfRobot, list[str]]:
    lines: list[str] = []
    bodies = BODY.format("a", "1 0 0", a) + BODY.format("b", "0 1 0", b)
    path = write(folder, f'<worldbody><body name="base">{bodies}</body></worldbody>\n{after}')
    robot = read_mjcf(path, warn=lines.append)
    return robot, [line.removeprefix(f"{path}:") for line in lines if "no force limit" not in line]


@pytest.mark.parametrize(
    ("actuators", "expected"),
    [
        ('<position joint="a" kp="10"/>', PositionDrive(10.0)),
        ('<position joint="a" kp="10" kv="2" forcerange="-4 5"/>', PositionDrive(10.0, 2.0, (-4.0, 5.0))),
        ('<position joint="a" kp="10" kv="2" gear="2" forcerange="-4 5"/>', PositionDrive(40.0, 8.0, (-8.0, 10.0))),
        ('<position joint="a" kp="10" gear="-2" forcerange="-4 5"/>', PositionDrive(40.0, 0.0, (-10.0, 8.0))),
        ('<position joint="a" kp="10" /><velocity joint="a" kv="3"/>', PositionDrive(10.0, 3.0)),
        (
            '<general joint="a" biastype="affine" gainprm=".3" biasprm="0 -100 -10" forcerange="-5 5"/>',
            PositionDrive(100.0, 10.0, (-5.0, 5.0)),
        ),
        ('<motor joint="a" ctrlrange="-3 3"/>', None),
        ('<velocity joint="a" kv="3"/>', None),
    ],
)
def test_gains_are_those_that_the_joint_feels(tmp_path: Path, actuators: str, expected: PositionDrive | None) -> None:
    robot, lines = read(tmp_path, f"<actuator>{actuators}</actuator>")
    assert (robot.drives.get("a"), lines) == (expected, [])


@pytest.mark.parametrize(
    ("actuator", "joint", "effort"),
    [
        ('<motor joint="a" ctrlrange="-3 3" gear="10"/>', "", 30.0),
        ('<motor joint="a" forcerange="-3 2"/>', "", 3.0),
        ('<position joint="a" kp="1" forcerange="-3 4"/>', 'actuatorfrcrange="-2 2"', 2.0),
        ('<position joint="a" kp="1" ctrlrange="-1 1"/>', "", math.inf),
        ('<position joint="b" kp="1" forcerange="-3 4"/>', 'actuatorfrcrange="-5 5"', 5.0),
    ],
)
def test_largest_force_is_the_actuators_within_the_joints(
    tmp_path: Path, actuator: str, joint: str, effort: float
) -> None:
    robot, _ = read(tmp_path, f"<actuator>{actuator}</actuator>", joint)
    assert robot.model.joint("a").limits.effort == effort


def test_actuator_of_a_tendon_drives_the_joint_that_the_others_follow(tmp_path: Path) -> None:
    actuator = '<actuator><position tendon="both" kp="100" forcerange="-10 10"/></actuator>'
    robot, lines = read(tmp_path, HAND + FOLLOWS + actuator)
    assert (robot.model.joint("b").mimic, lines) == (Mimic("a"), [])
    assert robot.drives == {"a": PositionDrive(100.0, 0.0, (-10.0, 10.0))}
    robot, lines = read(tmp_path, HAND + actuator)
    assert (robot.drives, lines) == ({}, ["3: position: the actuator drives no single joint, and is left out"])


def test_equality_of_joints_is_a_joint_that_follows(tmp_path: Path) -> None:
    equality = '<equality><joint joint1="b" joint2="a" polycoef="0.1 -2 0 0 0"/></equality>'
    robot, _ = read(tmp_path, f'<compiler angle="radian"/>{equality}', 'ref="0.3"', 'ref="0.5"')
    mimic = robot.model.joint("b").mimic
    assert mimic is not None
    assert (mimic.joint, mimic.multiplier) == ("a", -2.0)
    assert mimic.offset == pytest.approx(0.5 + 0.1 + 2 * 0.3)
    robot, _ = read(tmp_path, '<equality><joint joint1="b" joint2="a" active="false"/></equality>')
    assert robot.model.joint("b").mimic is None


def test_joints_keep_armature_and_friction_and_lose_springs(tmp_path: Path) -> None:
    robot, lines = read(tmp_path, "", 'armature="0.1" damping="0.2" frictionloss="0.3"', 'stiffness="5"')
    assert robot.dynamics == {"a": JointDynamics(0.1, 0.2, 0.3)}
    assert lines == ["2: joint[b]: the spring of the joint is left out"]


@pytest.mark.parametrize(
    ("after", "why"),
    [
        (
            '<equality><weld body1="base" name="w"/></equality>',
            r"arm\.xml:3: weld\[w\]: a robot is a tree of joints, without an equality of type weld; remove it",
        ),
        (
            '<equality><joint joint1="b" joint2="a" polycoef="0 1 1 0 0"/></equality>',
            r"joint: a joint can only follow one other in proportion; use joint1, joint2 and polycoef c0 c1",
        ),
        ('<equality><joint joint1="b"/></equality>', r"a joint can only follow one other in proportion"),
        (f'{FOLLOWS}<equality><joint joint1="b" joint2="a"/></equality>', r"'b' follows another joint already"),
        (
            f'{FOLLOWS}<equality><joint joint1="a" joint2="b"/></equality>',
            r"the joints follow each other in a loop; remove one of the equalities",
        ),
        (
            HAND.replace('name="both"', 'name="both" stiffness="3"'),
            r"arm\.xml:3: fixed\[both\]: a robot's tendon only passes force on; remove its limits, stiffness",
        ),
    ],
)
def test_what_joints_cannot_hold_is_refused(tmp_path: Path, after: str, why: str) -> None:
    with pytest.raises(DescriptionError, match=why):
        read(tmp_path, after)


def test_spatial_tendon_is_refused(tmp_path: Path) -> None:
    inside = (
        '<worldbody><body name="a"><geom size="0.1"/><site name="s"/><site name="t" pos="1 0 0"/></body></worldbody>\n'
        '<tendon><spatial name="rope"><site site="s"/><site site="t"/></spatial></tendon>'
    )
    with pytest.raises(
        DescriptionError, match=r"arm\.xml:3: spatial\[rope\]: a robot has no spatial tendons; remove it"
    ):
        read_mjcf(write(tmp_path, inside), warn=pytest.fail)
