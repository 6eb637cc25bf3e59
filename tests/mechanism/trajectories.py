"""Strategies and helpers for the tests of joint trajectories."""

from collections.abc import Sequence

from hypothesis import strategies as st

from cellwright.mechanism.joint_trajectory import JointTrajectory, TrajectoryPoint
from cellwright.mechanism.trajectory_controller import JointTrajectoryController

SECOND = 1_000_000_000
STEP = 2_000_000

JOINTS = (
    "linear_arm_actuator_joint",
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
)
START = (0.0, 3.14, -1.13, 1.51, 3.77, -1.51, 0.0)

numbers = st.floats(-6.0, 6.0)
rows = st.lists(numbers, min_size=len(JOINTS), max_size=len(JOINTS))


@st.composite
def commands(draw: st.DrawFn, carries: Sequence[str] = ("", "v", "va", "a")) -> JointTrajectory:
    """Valid commands of all joints, starting at once, whose points carry only positions, or velocities and more."""
    carried = draw(st.sampled_from(carries))
    times = draw(st.lists(st.integers(STEP, 5 * SECOND), min_size=1, max_size=4, unique=True))
    points = [
        TrajectoryPoint(draw(rows), draw(rows) if "v" in carried else (), draw(rows) if "a" in carried else (), time)
        for time in sorted(times)
    ]
    return JointTrajectory(draw(st.permutations(JOINTS)), points)


def controller() -> JointTrajectoryController:
    """Return a controller in the arm's initial posture, at time 0."""
    made = JointTrajectoryController(JOINTS)
    made.start(START, 0)
    return made


def to(*positions: Sequence[float], every: int = SECOND, start: int | None = None) -> JointTrajectory:
    """Return a command of positions only, a point each `every` [ns]."""
    points = [TrajectoryPoint(row, time_from_start_ns=every * (k + 1)) for k, row in enumerate(positions)]
    return JointTrajectory(JOINTS, points, start)
