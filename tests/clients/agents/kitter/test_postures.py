"""Questions of the kitter to every arm: a UR10 on its rail and a described arm answer alike."""

import math

import pytest

from cellwright.clients.agents.kitter.postures import Postures
from cellwright.motion import tool_down
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.arms import described, kitting
from tests.clients.agents.kitter.places import ARM

CASES = [(ARM, tool_down(-0.3, 0.23, 0.95)), (described(kitting("ur5")), tool_down(-0.1, 0.5, 0.64))]


@pytest.mark.parametrize(("arm", "goal"), CASES, ids=["ur10", "ur5"])
def test_figures_have_one_entry_a_joint(arm: Postures, goal: Pose) -> None:
    figures, q = arm.figures, next(arm.usual(goal, 0.2, arm.figures.home))
    lengths = {len(each) for each in (figures.joints, figures.is_soft, figures.speed, figures.steps, figures.home, q)}
    assert len(lengths) == 1
    assert figures.heights.hover <= figures.heights.travel <= figures.heights.waiting


@pytest.mark.parametrize(("arm", "goal"), CASES, ids=["ur10", "ur5"])
def test_usual_posture_reaches_its_pose_and_is_kept_when_taken_again(arm: Postures, goal: Pose) -> None:
    rail = arm.on_rail(arm.rail_beside(*goal.position[:2]))
    chosen = next(arm.usual(goal, rail, arm.figures.home))
    assert math.dist(arm.tool(chosen).position, goal.position) < 1e-5
    assert arm.again(goal, chosen, arm.figures.home) == pytest.approx(chosen)
    assert arm.step(goal, chosen) == pytest.approx(chosen, abs=1e-6)
    assert arm.reaches(goal, rail)
    x, y, _ = goal.position
    assert arm.way_to(chosen, x, y) < arm.way_to(chosen, x + 0.2, y + 1.2)


@pytest.mark.parametrize(("arm", "goal"), CASES, ids=["ur10", "ur5"])
def test_motion_begins_and_ends_at_rest(arm: Postures, goal: Pose) -> None:
    chosen = next(arm.usual(goal, 0.2, arm.figures.home))
    times, positions, velocities = arm.motion(arm.figures.home, [chosen])
    assert times[0] == 0.0 < times[-1]
    assert positions[0] == pytest.approx(arm.figures.home)
    assert positions[-1] == pytest.approx(chosen)
    assert {*velocities[0], *velocities[-1]} == {0.0}
