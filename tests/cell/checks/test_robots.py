"""Check of robots in a cell."""

from cellwright.cell.checks.robots import robot_problems
from tests.cell.robot_cells import ASIDE, AT_BIN, BESIDE_ARM, tandem_cell


def test_robot_that_stands_free_is_accepted() -> None:
    assert robot_problems(tandem_cell()) == []


def test_robot_within_the_floor_is_refused_with_link_and_depth() -> None:
    found = robot_problems(tandem_cell(ASIDE.replace("1.16", "1.0")))
    assert {each.key for each in found} == {"cell.robots.qinglong"}
    assert all(each.message.startswith("Link_") for each in found)
    assert all(each.message.endswith("within the floor; move the robot, or raise it: at") for each in found)
    assert any("Link_ankle_l_roll begins 0.150 m" in each.message for each in found)


def test_robot_within_a_bin_is_refused() -> None:
    found = robot_problems(tandem_cell(AT_BIN.replace("at: [0.8, 0.0]", "at: [0.3, 0.26]").replace("0.5}", "0.68}")))
    assert any("within bin1" in each.message for each in found)


def test_robot_within_an_arm_or_its_rail_is_refused() -> None:
    assert robot_problems(tandem_cell(BESIDE_ARM)) == []
    found = [
        *robot_problems(tandem_cell(BESIDE_ARM.replace("at: [-0.3, 1.15, 0.5]", "at: [0.3, 1.15, 0.0]"))),
        *robot_problems(tandem_cell(BESIDE_ARM.replace("at: [-0.3, 1.15, 0.5]", "at: [0.3, 0.0, 0.4]"))),
    ]
    assert {each.key for each in found} == {"cell.robots.tandem"}
    assert any("m within linear_arm_actuator;" in each.message for each in found)
    assert any("m within shoulder_link;" in each.message for each in found)


def test_the_later_of_two_robots_within_each_other_is_refused() -> None:
    other = "    other: {model: tandem, at: [0.0, 0.1, 0.0]}\n  bins"
    found = robot_problems(tandem_cell(AT_BIN.replace("  bins", other)))
    assert {each.key for each in found} == {"cell.robots.other"}
    assert all(" m within tandem_" in each.message for each in found)
