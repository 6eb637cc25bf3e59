"""Drives that an MJCF file gives the joints of an arm."""

from pathlib import Path

import pytest

from cellwright.config.robot.given_drives import given_drives
from cellwright.util.errors import UsageError
from tests.config.robot.mjcf_robots import write

JOINT = '<body name="{0}"><joint name="{0}_joint" axis="0 0 1" {1}/><geom size="0.1"/>'


def arm(folder: Path, actuators: str) -> Path:
    """Write an arm of two joints with actuators."""
    bodies = JOINT.format("upper", 'damping="2" armature="0.3" frictionloss="0.5"') + JOINT.format("lower", "")
    inside = f"<worldbody><body>{bodies}</body></body></body></worldbody><actuator>{actuators}</actuator>"
    return write(folder, inside)


def test_gains_and_friction_are_those_of_the_file(tmp_path: Path) -> None:
    path = arm(
        tmp_path,
        '<position joint="upper_joint" kp="900" kv="40" forcerange="-60 60"/>'
        '<general joint="lower_joint" gainprm="50" biastype="affine" biasprm="0 -50 -4" gear="2"/>',
    )
    drives = given_drives(path, ["upper_joint", "lower_joint"])
    upper, lower = drives["upper_joint"], drives["lower_joint"]
    assert (upper.servo.kp, upper.servo.kv, upper.servo.force_range) == (900.0, 40.0, (-60.0, 60.0))
    assert (upper.dynamics.damping, upper.dynamics.armature, upper.dynamics.friction) == (2.0, 0.3, 0.5)
    # through the gear, with which both the error and the force grow
    assert (lower.servo.kp, lower.servo.kv) == (200.0, 16.0)
    assert (lower.dynamics.damping, lower.dynamics.armature, lower.dynamics.friction) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("actuators", "message"),
    [
        ("", "arm.xml has no position actuator for upper_joint, lower_joint, and a motor follows no positions"),
        ('<position joint="lower_joint" kp="9"/>', "no position actuator for upper_joint, and"),
        (
            '<position joint="upper_joint" kp="9"/><motor joint="lower_joint" ctrlrange="-5 5"/>',
            "no position actuator for lower_joint, and a motor follows no positions; write <position joint='lower_jo",
        ),
        ('<position joint="upper_joint" kp="9"/><velocity joint="lower_joint" kv="9"/>', "actuator for lower_joint"),
        (
            '<position joint="upper_joint" kp="9" forcerange="-4 7"/><position joint="lower_joint" kp="9"/>',
            "the drive of upper_joint in arm.xml pushes from -4 to 7, and a drive here pushes alike both ways",
        ),
    ],
)
def test_what_follows_no_positions_is_refused(tmp_path: Path, actuators: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        given_drives(arm(tmp_path, actuators), ["upper_joint", "lower_joint"])
    assert message in str(caught.value)
    assert str(caught.value).endswith("use drives: stiff")


def test_urdf_gives_no_drives() -> None:
    urdf = Path(__file__).parents[2] / "data" / "arms" / "ur5.urdf"
    with pytest.raises(UsageError, match=r"only an MJCF file gives drives \(got ur5.urdf\); use drives: stiff"):
        given_drives(urdf, ["elbow_joint"])
