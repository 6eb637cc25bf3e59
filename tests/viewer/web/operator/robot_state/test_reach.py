"""Reach of a hand, from its motion in the robot's own time."""

from cellwright.util.pose import Pose
from cellwright.viewer.web.operator.robot_state import Reach, ReachOfHand, rotation_angle

SECOND = 1_000_000_000
AIM = Pose((1.0, 0.0, 0.0))


def test_reach_at_target_is_there() -> None:
    watch = ReachOfHand()
    assert watch.look(0, None, AIM) is Reach.THERE
    assert watch.look(1, AIM, Pose((0.999, 0.0, 0.0))) is Reach.THERE


def test_reach_of_resting_hand_becomes_short() -> None:
    watch = ReachOfHand()
    for step in range(10):
        assert watch.look(step * SECOND // 10, AIM, Pose((0.05 * step, 0.0, 0.0))) is Reach.ON_ITS_WAY
    assert watch.look(SECOND, AIM, Pose((0.5, 0.0, 0.0))) is Reach.ON_ITS_WAY, "it has only just come to rest"
    stuck = [watch.look(SECOND + step * SECOND // 10, AIM, Pose((0.5, 0.0, 0.0))) for step in range(1, 8)]
    assert stuck[-1] is Reach.SHORT
    further = Pose((1.5, 0.0, 0.0))
    assert watch.look(2 * SECOND, further, Pose((0.5, 0.0, 0.0))) is Reach.SHORT, "pulling harder does not help"
    assert watch.look(3 * SECOND, AIM, Pose((0.6, 0.0, 0.0))) is Reach.ON_ITS_WAY


def test_reach_of_paused_robot_is_not_short() -> None:
    watch = ReachOfHand()
    assert {watch.look(SECOND, AIM, Pose()) for _ in range(100)} == {Reach.ON_ITS_WAY}
    assert watch.look(0, AIM, Pose()) is Reach.ON_ITS_WAY, "nor one whose time was reset"


def test_reach_counts_rotation() -> None:
    watch = ReachOfHand()
    turned = Pose.from_rpy((1.0, 0.0, 0.0), (0.0, 0.0, 0.5))
    assert abs(rotation_angle(AIM, turned) - 0.5) < 1e-9
    assert watch.look(0, turned, AIM) is Reach.ON_ITS_WAY
    assert watch.look(SECOND, turned, AIM) is Reach.SHORT
