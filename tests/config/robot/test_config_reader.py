"""Robot configuration files: entries that are read, warned of or refused, each with its place."""

import string
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import UNUSED, ArmConfig, GripperConfig, Posture, RobotConfig
from cellwright.config.robot.robots import ENTRIES, read_robot_config
from cellwright.util.errors import DescriptionError
from tests.config.robot.small_robot import CONFIG, INDICES, urdf, write
from tests.conftest import load_cases

CASES = load_cases("robot_config_cases.json")


def read(path: Path) -> tuple[RobotConfig, list[str]]:
    warnings: list[str] = []
    config = read_robot_config(path, warnings.append)
    return config, [line.removeprefix(f"{path}:") for line in warnings]


def read_errors(path: Path) -> list[str]:
    with pytest.raises(DescriptionError) as caught:
        read_robot_config(path, lambda _line: None)
    return [str(problem).removeprefix(f"{path.parent}/") for problem in caught.value.problems]


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> RobotConfig:
    config, warnings = read(write(tmp_path_factory.mktemp("small")))
    assert warnings == []
    return config


def test_joint_indices_count_parents_first(small: RobotConfig) -> None:
    assert tuple(small.robot.joint_indices) == INDICES
    assert small.robot.written != INDICES
    assert sorted(small.robot.written) == sorted(INDICES)


def test_configuration_groups_have_names_and_homes(small: RobotConfig) -> None:
    assert small.name == "Small"
    assert small.arms == (ArmConfig(("r1", "r2"), "r_hand", (0.1, 0.2)), ArmConfig(("l1", "l2"), "l_hand", (-0.1, 0.2)))
    assert small.grippers == (GripperConfig(("r_finger", "r_thumb")), GripperConfig(("l_finger", "l_thumb")))
    assert (small.head, small.head_axes) == (Posture(("head_pitch", "head_yaw"), (0.3, 0.0)), (1, 2))
    assert small.dorsal == Posture(("lift",), (0.25,))
    assert small.waist == Posture(("spin",), (0.5,))
    assert small.command_links == ("r_hand", "l_hand")
    assert small.reference_links == ("torso", None)
    assert small.fixed_link is None


def test_home_includes_groups_and_open_grippers(small: RobotConfig) -> None:
    assert small.start == {"r1": 0.1, "r2": 0.2, "l1": -0.1, "l2": 0.2}
    others = {"spin": 0.5, "head_pitch": 0.3, "head_yaw": 0.0, "lift": 0.25, "r_finger": 0.0, "l_finger": 0.0}
    assert small.home == small.start | others


def test_known_unused_entries_are_kept(small: RobotConfig) -> None:
    assert small.others == {"vibration_thresholds": {"ee_dist": [0.15, 0.2], "tabletop_height": 0.85}}


def test_configuration_with_only_urdf_path_is_valid(tmp_path: Path) -> None:
    config, warnings = read(write(tmp_path, "urdf_path: robot.urdf\n"))
    assert warnings == []
    assert config.name == "small"
    assert (config.arms, config.grippers, config.head, config.waist, config.home) == ((), (), None, None, {})
    assert config.base_pose.position == (0, 0, 0)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case["name"])
def test_configuration_case_gives_expected_values_and_lines(case: dict[str, Any], tmp_path: Path) -> None:
    path = write(tmp_path, case["yaml"])
    (tmp_path / "robot.urdf").write_text(case.get("urdf", urdf()))
    warnings: list[str] = []
    problems: list[str] = []
    try:
        config = read_robot_config(path, warnings.append)
    except DescriptionError as error:
        problems = [str(problem) for problem in error.problems]
    else:
        for name, value in case.get("values", {}).items():
            assert plain(getattr(config, name)) == value
    for found, expected in ((problems, case.get("problems", [])), (warnings, case.get("warnings", []))):
        assert len(found) == len(expected), found
        for line, start in zip(found, expected, strict=True):
            assert line.removeprefix(f"{tmp_path}/").startswith(start)


def plain(value: Any) -> Any:
    """Return a value of a configuration as in JSON."""
    if isinstance(value, tuple):
        return [plain(item) for item in value]
    if isinstance(value, ArmConfig | Posture | GripperConfig):
        names = ("joints", "tip", "home", "open_ends")
        return [plain(getattr(value, name)) for name in names if getattr(value, name, None)]
    return value


def test_all_configuration_errors_are_listed_at_once(tmp_path: Path) -> None:
    text = CONFIG.replace("[1, 2]", "[1, 3]").replace("ee_index: 8", "ee_index: 80").replace("[0.5]", "[.nan]")
    found = read_errors(write(tmp_path, text))
    assert [line.split(": ")[:2] for line in found] == [
        ["vr_configs.yml:6", "arms[0].joint_index[1]"],
        ["vr_configs.yml:7", "arms[1].ee_index"],
        ["vr_configs.yml:13", "waist.rest_j_pos[0]"],
    ]


def test_urdf_errors_are_listed_for_configuration(tmp_path: Path) -> None:
    path = write(tmp_path, CONFIG + "robot_nam: x\n")
    (tmp_path / "robot.urdf").write_text("<robot name='a'>\n<link name='b'>\n</robot>")
    (line,) = read_errors(path)
    assert line.startswith("robot.urdf:")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("- 1\n", "vr_configs.yml:1: a robot configuration must be a mapping of entries (got a list)"),
        ("", "vr_configs.yml: the required entry 'urdf_path' is missing"),
        ("a: [\n", "vr_configs.yml:1: invalid YAML: "),
        ("a: 1\n---\nb: 2\n", "vr_configs.yml:2: invalid YAML: a second document starts here"),
        ("urdf_path: !!python/name:os.system ''\n", "vr_configs.yml:1: the tag "),
    ],
)
def test_invalid_configuration_files_are_refused(text: str, message: str, tmp_path: Path) -> None:
    (line,) = read_errors(write(tmp_path, text))
    assert line.startswith(message)


def test_folder_or_missing_file_is_refused(tmp_path: Path) -> None:
    assert read_errors(tmp_path) == [f"{tmp_path.name}: cannot be read: Is a directory"]
    assert read_errors(tmp_path / "no.yml") == ["no.yml: cannot be read: No such file or directory"]


def test_used_and_unused_entries_are_disjoint() -> None:
    assert not set(ENTRIES.names) & set(UNUSED)


WHOLE: dict[str, Any] = yaml.safe_load(CONFIG)
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(string.printable, max_size=8),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.sampled_from([*ENTRIES.names, "x"]), inner, max_size=3)
    ),
    max_leaves=6,
)


@given(st.sets(st.sampled_from(sorted(WHOLE))))
@settings(max_examples=30)
def test_optional_entries_may_be_missing(
    small: RobotConfig, tmp_path_factory: pytest.TempPathFactory, left: set[str]
) -> None:
    rest = {name: value for name, value in WHOLE.items() if name not in left or name == "urdf_path"}
    if "arms" in left:
        rest.pop("controller_indices", None)
    config, warnings = read(write(tmp_path_factory.getbasetemp(), yaml.safe_dump(rest)))
    assert warnings == []
    for name in ("arms", "grippers", "head", "dorsal", "waist"):
        assert getattr(config, name) == (getattr(small, name) if name not in left else type(getattr(config, name))())


@pytest.mark.slow
@given(st.data())
@settings(max_examples=80)
def test_damaged_configuration_is_read_or_refused_with_place(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    folder = tmp_path_factory.getbasetemp()
    damaged = data.draw(broken(WHOLE))
    path = write(folder, yaml.safe_dump(damaged))
    problems = [f"{path}: none"]
    try:
        read(path)
    except DescriptionError as error:
        problems = [str(problem) for problem in error.problems]
    assert problems
    assert all(line.startswith(f"{path}:") for line in problems)


def broken(tree: Any) -> st.SearchStrategy[Any]:
    """Return the tree with one of its values replaced."""

    @st.composite
    def build(draw: st.DrawFn, node: Any) -> Any:
        if not isinstance(node, dict | list) or not node or draw(st.integers(0, 3)) == 0:
            return draw(ANYTHING)
        place = draw(st.sampled_from(list(node) if isinstance(node, dict) else range(len(node))))
        changed = draw(build(node[place]))
        if isinstance(node, dict):
            return {**node, place: changed}
        return [changed if number == place else item for number, item in enumerate(node)]

    return build(tree)


@given(st.text(max_size=60) | st.binary(max_size=60).map(lambda data: data.decode("latin-1")))
@settings(max_examples=60)
def test_any_text_as_configuration_is_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    path = write(tmp_path_factory.getbasetemp(), "")
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    assert read_errors(path)
