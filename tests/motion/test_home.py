import pytest

from cellwright.motion.chain import Chain
from cellwright.motion.home import MIN_SINGULAR, bent_home, home_fault
from tests.motion.arms import arm, ur_chain
from tests.motion.ur_arms import UR_ARMS


@pytest.mark.parametrize("name", ["ur5", "ur10", "panda", "iiwa7", "xarm6", "xarm7"])
def test_singular_home_is_refused_and_bent_one_accepted(name: str) -> None:
    chain, home = arm(name)
    assert home_fault(chain, home) is None
    straight = (0.0,) * len(home)
    fault = home_fault(chain, straight)
    assert fault is not None
    assert "(got 0.0000 m)" in fault
    bent = bent_home(chain, straight)
    assert bent is not None
    assert home_fault(chain, bent) is None
    assert chain.margin(bent).limit > 0.0
    for joint, value in zip(chain.joints, bent, strict=True):
        assert (f"{joint.name}: {value:g}" in fault) == (value != 0.0)


def test_bent_home_changes_few_joints() -> None:
    chain, home = arm("iiwa7")
    bent = bent_home(chain, (0.0,) * len(home))
    assert bent is not None
    assert sum(value != 0.0 for value in bent) <= 3


def test_arm_without_room_to_bend_gets_another_remedy() -> None:
    chain = ur_chain(UR_ARMS["UR5"], 0.01)
    assert bent_home(chain, (0.0,) * 6) is None
    fault = home_fault(chain, (0.0,) * 6)
    assert fault is not None
    assert fault.endswith("; choose a home where it is bent")


def test_threshold_counts() -> None:
    chain: Chain = arm("ur5").chain
    good = (0.0, -1.2, 1.6, -2.0, -1.57, 0.0)
    for elbow in (0.02, 0.05, 0.1, 0.2, 0.4):
        q = (*good[:2], elbow, *good[3:])
        assert (home_fault(chain, q) is None) == (chain.margin(q).singular >= MIN_SINGULAR)
