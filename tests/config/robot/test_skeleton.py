"""Draft of a configuration: its findings on robots, and that it is valid as it is."""

from pathlib import Path

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.limbs import MIN_ARM_JOINTS, find_limbs
from cellwright.config.robot.model import RobotModel
from cellwright.config.robot.robots import bundled, load_robot, read_robot_config
from cellwright.config.robot.skeleton import skeleton
from cellwright.config.robot.urdf import read_urdf
from tests.config.robot import torso_robot
from tests.config.robot.small_robot import SHAPE


def robot(folder: Path, *joints: tuple[str, str, str, str], limits: str = 'lower="-1" upper="2"') -> RobotModel:
    """Return a robot of joints (name, type, parent, child); its first parent is the root."""
    links = dict.fromkeys(name for _, _, parent, child in joints for name in (parent, child))
    lines = [f"<link name='{name}'>{SHAPE}</link>" for name in links]
    for number, (name, kind, parent, child) in enumerate(joints):
        axis = ("1 0 0", "0 1 0", "0 0 1")[number % 3]
        lines.append(
            f"<joint name='{name}' type='{kind}'><parent link='{parent}'/><child link='{child}'/>"
            f"<axis xyz='{axis}'/><limit {limits} effort='1' velocity='1'/></joint>"
        )
    path = folder / "robot.urdf"
    path.write_text(f"<robot name='made'>{''.join(lines)}</robot>")
    return read_urdf(path, warn=lambda _line: None)


def chain(name: str, base: str, count: int, kind: str = "revolute") -> list[tuple[str, str, str, str]]:
    """Return joints NAME1, NAME2, … in series on a link."""
    links = [base, *(f"{name}_link{number + 1}" for number in range(count))]
    return [(f"{name}{number + 1}", kind, links[number], links[number + 1]) for number in range(count)]


def read_back(folder: Path, model: RobotModel) -> tuple[RobotConfig, list[str]]:
    path = folder / "vr_configs.yml"
    path.write_text(skeleton(model, folder / "robot.urdf", folder))
    warnings: list[str] = []
    return read_robot_config(path, warnings.append), warnings


@pytest.mark.parametrize("name", bundled())
def test_limbs_of_bundled_robots_match_their_configurations(name: str) -> None:
    config = load_robot(name, lambda _line: None)
    found = find_limbs(config.robot)
    assert [arm.joints for arm in found.arms] == [arm.joints for arm in config.arms]
    assert [arm.tip for arm in found.arms] == [arm.tip for arm in config.arms]
    assert len(found.grippers) == len(config.grippers)
    for guessed, gripper in zip(found.grippers, config.grippers, strict=True):
        assert set(gripper.joints) <= set(guessed.joints)
    if config.head is not None:
        assert tuple(filter(None, found.head)) == config.head.joints


def test_finger_spreading_joints_are_not_in_gripper() -> None:
    (right, left) = find_limbs(load_robot("qinglong", lambda _line: None).robot).grippers
    assert {"rh_FFJ4", "rh_THJ5", "rh_LFJ4"}.isdisjoint(right.joints)
    assert {"rh_FFJ3", "rh_THJ1"} <= set(right.joints)
    assert len(left.joints) == len(right.joints)


def test_arms_with_sides_in_names_come_right_first(tmp_path: Path) -> None:
    model = robot(tmp_path, *chain("left_arm_", "base", 5), *chain("right_arm_", "base", 5), *chain("leg_", "base", 6))
    assert [arm.joints[0] for arm in find_limbs(model).arms] == ["right_arm_1", "left_arm_1"]


def test_joints_below_arms_are_lift_and_waist(tmp_path: Path) -> None:
    trunk = [("rail", "prismatic", "base", "cart"), ("turn", "revolute", "cart", "torso")]
    model = robot(tmp_path, *trunk, *chain("a", "torso", 4), *chain("b", "torso", 4), *chain("neck", "torso", 2))
    found = find_limbs(model)
    assert found.lift is not None
    assert found.waist is not None
    assert (found.lift.joints, found.waist.joints) == (("rail",), ("turn",))
    assert sorted(filter(None, found.head)) == ["neck1", "neck2"]


def test_sliding_joint_at_chain_end_is_gripper_not_arm(tmp_path: Path) -> None:
    joints = [*chain("j", "base", 6), ("slide", "prismatic", "j_link6", "pad")]
    found = find_limbs(robot(tmp_path, *joints, limits='lower="0" upper="1"'))
    assert found.arms[0].joints == tuple(f"j{number}" for number in range(1, 7))
    assert [gripper.joints for gripper in found.grippers] == [("slide",)]


def test_fixed_link_named_tool_is_arm_tip(tmp_path: Path) -> None:
    fixed = [("f1", "fixed", "j_link4", "flange"), ("f2", "fixed", "flange", "tool0"), ("f3", "fixed", "base", "tcp")]
    found = find_limbs(robot(tmp_path, *chain("j", "base", 4), *fixed))
    assert found.arms[0].tip == "tool0"


def test_skeleton_without_limbs_has_comment_and_no_groups(tmp_path: Path) -> None:
    model = robot(tmp_path, *chain("wheel", "base", 1, "continuous"))
    text = skeleton(model, tmp_path / "robot.urdf", tmp_path)
    assert "# No arm was found" in text
    assert list(yaml.safe_load(text)) == ["urdf_path", "robot_name", "base_pose"]
    config, warnings = read_back(tmp_path, model)
    assert (config.arms, config.grippers, config.head, warnings) == ((), (), None, [])


def test_home_in_skeleton_is_within_limits_exactly(tmp_path: Path) -> None:
    model = robot(tmp_path, *chain("j", "base", 5), limits='lower="0.12345672" upper="0.12345679"')
    config, warnings = read_back(tmp_path, model)
    assert warnings == []
    assert all(0.12345672 <= position <= 0.12345679 for position in config.arms[0].home)


@pytest.mark.parametrize(
    ("lower", "upper", "home"),
    [
        (-1.0, 2.0, 0.0),
        (0.0, 2.6, 0.5),  # an elbow that is stretched at 0
        (-3.14, 0.0, -0.5),
        (-0.0873, 3.8223, 0.413),
        (-2.9, -0.1, -0.6),
        (0.0, 0.4, 0.1),
    ],
)
def test_arm_home_is_bent_away_from_limit_at_zero(lower: float, upper: float, home: float, tmp_path: Path) -> None:
    model = robot(tmp_path, *chain("j", "base", 4), limits=f'lower="{lower}" upper="{upper}"')
    config, _ = read_back(tmp_path, model)
    assert config.arms[0].home == (home,) * 4


NAMES = st.sampled_from(["yes", "1", "a: b", "[x", "it's", "#", "r arm", "größe", "-", "null", "1e3", "l_hand", "x y"])


@given(st.lists(st.integers(0, 30), min_size=1, max_size=16), st.lists(NAMES, unique=True, max_size=8), st.randoms())
@settings(max_examples=60)
def test_skeleton_of_random_tree_loads_without_warnings(
    tmp_path_factory: pytest.TempPathFactory, parents: list[int], names: list[str], random: object
) -> None:
    folder = tmp_path_factory.getbasetemp()
    links = [f"link{number}" for number in range(len(parents) + 1)]
    kinds = ["revolute", "prismatic", "continuous", "fixed", "spherical"]
    called = [*names, *(f"joint{number}" for number in range(len(parents)))]
    joints = [
        (
            called[number].replace("'", "&apos;"),
            kinds[parent % 5 if parent > 20 else 0],
            links[parent % (number + 1)],
            links[number + 1],
        )
        for number, parent in enumerate(parents)
    ]
    model = robot(folder, *joints)
    config, warnings = read_back(folder, model)
    assert warnings == []
    assert all(len(arm.joints) >= MIN_ARM_JOINTS for arm in config.arms)


@pytest.mark.parametrize(
    ("fingers", "line", "open_positions"),
    [
        (torso_robot.INWARDS, "    open: upper   # guessed", [0.04, 0.04]),
        ((("0 1 0", 0.0, 0.04), ("0 1 0", -0.04, 0.0)), "    open: [upper, lower]   # guessed", [0.04, -0.04]),
        ((("0 1 0", -0.04, 0.0), ("0 -1 0", -0.04, 0.0)), "    open: ", [-0.04, -0.04]),
        ((("0 1 0", 0.0, 0.04),) * 3, "    # The open end is unknown", [0.0] * 3),
    ],
)
def test_skeleton_has_open_end_of_gripper_if_known(
    tmp_path: Path, fingers: tuple[tuple[str, float, float], ...], line: str, open_positions: list[float]
) -> None:
    path = torso_robot.write(tmp_path, torso_robot.urdf(fingers=fingers))
    model = read_urdf(path, warn=lambda _line: None)
    lines = [each for each in skeleton(model, path, tmp_path).splitlines() if each.startswith(line)]
    assert len(lines) == (0 if open_positions == [-0.04, -0.04] else 2)  # the lower limits need no entry
    config, warnings = read_back(tmp_path, model)
    assert warnings == []
    left = config.grippers[1]
    assert [left.open_and_closed(model.joint(name))[0] for name in left.joints] == open_positions


def test_skeleton_on_another_drive_has_absolute_urdf_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On Windows, drives have no relative path between them; the draft has the absolute path."""

    def refuse(_path: object, _start: object) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    model = robot(tmp_path, *chain("arm", "base", 4))
    monkeypatch.setattr("os.path.relpath", refuse)
    config, warnings = read_back(tmp_path, model)
    assert not warnings
    assert config.urdf_path == tmp_path / "robot.urdf"
