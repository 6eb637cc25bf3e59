"""Robots in the section `cell`."""

from pathlib import Path

import pytest

from cellwright.config.layout.robots import MAX_ROBOTS, NAMESPACE
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import DescriptionError

URDF = '<robot name="post"><link name="base"/></robot>'


def read(folder: Path, *robots: str) -> Trial:
    """Return the trial of a cell with these robots."""
    lines = ["cell:", "  robots:", *(f"    {robot}" for robot in robots)]
    (folder / "cell.yaml").write_text("\n".join(lines))
    return load_trial([folder / "cell.yaml"]).trial


def refusals(folder: Path, *robots: str) -> list[str]:
    """Return what is wrong, without the names of files."""
    with pytest.raises(DescriptionError) as caught:
        read(folder, *robots)
    return [str(problem).replace(f"{folder}/", "") for problem in caught.value.problems]


def test_bundled_robot_is_read(tmp_path: Path) -> None:
    trial = read(tmp_path, "left: {model: tandem, at: [1, 2, 0.5], turn: pi/2}")
    (robot,) = trial.layout.robots
    assert (robot.name, robot.model, robot.namespace) == ("left", "tandem", NAMESPACE)
    assert robot.pose.position == (1.0, 2.0, 0.5)
    assert trial.robot_models["left"].name == "tandem"


def test_file_beside_the_cell_is_read(tmp_path: Path) -> None:
    (tmp_path / "post.urdf").write_text(URDF)
    assert read(tmp_path, "post: {model: post.urdf, at: [0, 0, 0]}").robot_models["post"].robot.root == "base"


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        (
            "left: {model: tandm, at: [0, 0, 0]}",
            "cell.yaml:3: cell.robots.left.model: unknown robot 'tandm'; did you mean tandem, or name a file",
        ),
        ("left: {model: none.urdf, at: [0, 0, 0]}", "left.model: there is no file none.urdf in"),
        (
            "left: {model: tandem, at: [0, 0, 0], namespce: left}",
            "cell.yaml:3: cell.robots.left.namespce: unknown entry; did you mean namespace",
        ),
        (
            "left: {model: tandem, at: [0, 0, 0], namespace: a/b}",
            "left.namespace: must be letters, digits and _, and no name of the cell's own (got 'a/b')",
        ),
        (
            "left: {model: tandem, at: [0, 0, 0], namespace: ariac}",
            "cell.yaml:3: cell.robots.left.namespace: the cell has the name /ariac; choose another",
        ),
        ("left: {model: tandem, at: [0, 0]}", "cell.yaml:3: cell.robots.left.at: must"),
        ("gripper: {model: tandem, at: [0, 0, 0]}", "cell.yaml:3: cell.robots.gripper: the cell has something else"),
    ],
)
def test_mistake_is_reported_at_its_line(tmp_path: Path, robot: str, message: str) -> None:
    (found,) = refusals(tmp_path, robot)
    assert message in found


def test_two_robots_need_two_namespaces(tmp_path: Path) -> None:
    one, other = ("left: {model: tandem, at: [0, 0, 0]}", "right: {model: tandem, at: [2, 0, 0]}")
    (found,) = refusals(tmp_path, one, other)
    assert found.endswith("left has the namespace 'io_teleop'; give each robot its own: namespace: right")
    trial = read(tmp_path, one, other.replace("}", ", namespace: right}"))
    assert [robot.namespace for robot in trial.layout.robots] == ["io_teleop", "right"]


def test_mistakes_of_the_robot_file_are_reported(tmp_path: Path) -> None:
    (tmp_path / "post.urdf").write_text(URDF.replace("</robot>", ""))
    assert any("post.urdf" in each for each in refusals(tmp_path, "post: {model: post.urdf, at: [0, 0, 0]}"))


def test_hands_of_arms_with_grippers_are_read(tmp_path: Path) -> None:
    trial = read(tmp_path, "duo: {model: tandem, at: [0, 0, 0], hands: {reach: 0.1}}")
    (robot,) = trial.layout.robots
    assert [(hand.name, hand.side, hand.link, hand.reach) for hand in robot.hands] == [
        ("duo/right", 0, "right_tip", 0.1),
        ("duo/left", 1, "left_tip", 0.1),
    ]


def test_hands_of_a_robot_without_grippers_are_refused(tmp_path: Path) -> None:
    (tmp_path / "post.urdf").write_text(URDF)
    (found,) = refusals(tmp_path, "post: {model: post.urdf, at: [0, 0, 0], hands: {}}")
    assert found.endswith("post has no arm with a gripper in its configuration; leave out hands")


def test_more_robots_than_the_engine_tells_apart_are_refused(tmp_path: Path) -> None:
    robots = [f"r{n}: {{model: tandem, at: [{n}, 0, 0], namespace: r{n}}}" for n in range(MAX_ROBOTS + 1)]
    (found,) = refusals(tmp_path, *robots)
    assert found == f"cell.yaml:{MAX_ROBOTS + 3}: cell.robots.r{MAX_ROBOTS}: a cell has at most 8 robots (got 9)"


def test_box_of_a_robot_is_around_its_links_at_the_start(tmp_path: Path) -> None:
    (robot,) = read(tmp_path, "left: {model: tandem, at: [1, 2, 0.5]}").layout.robots
    (low, high), tips = robot.box, [corner[2] for corner in robot.corners]
    assert -0.2 < low[2] < 0.0
    assert 1.0 < high[2] < 1.5
    assert (min(tips), max(tips)) == pytest.approx((low[2] + 0.5, high[2] + 0.5))
