"""The page on simulation interfaces: its example puts a part onto a tray, and its table has the features."""

import re
from pathlib import Path

import pytest

from cellwright.middleware.ros2.packages.contents import definitions
from cellwright.viewer.services.simulation import OF_ENTITIES, OF_TIME, PUBLIC
from cellwright.viewer.services.world_services import OF_LOADING, OF_WORLDS
from tests.docs.pages import blocks

PAGE = Path(__file__).parents[2] / "docs" / "simulation-interfaces.md"


def test_example_puts_part_onto_tray(capsys: pytest.CaptureFixture[str]) -> None:
    (example,) = (each.body for each in blocks(PAGE) if each.language == "python")
    exec(compile(example, str(PAGE), "exec"), {})
    assert capsys.readouterr().out == "['bin8|gear_part_1']\n"


def table_of_features() -> dict[str, list[str]]:
    """Return the rows of the page's table by the name of their feature."""
    lines = PAGE.read_text().partition("| number | feature |")[2].partition("\n\n")[0].splitlines()[2:]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return {row[1]: row for row in rows}


def test_table_has_the_features_of_the_standard_and_ours_as_they_are() -> None:
    rows = table_of_features()
    sums = rows.pop("sum")
    text = definitions()["simulation_interfaces"]["msg/SimulatorFeatures.msg"]
    constants = {name: int(number) for name, number in re.findall(r"^\w+ (\w+)\s*=\s*(\d+)", text, re.MULTILINE)}
    assert {name: int(row[0]) for name, row in rows.items()} == constants
    ours = OF_TIME | OF_ENTITIES | OF_WORLDS | OF_LOADING
    for column, features in ((5, ours), (6, PUBLIC), (7, OF_TIME)):
        assert {int(row[0]) for row in rows.values() if row[column]} == features
    for column in range(2, 8):
        assert int(sums[column]) == sum(bool(row[column]) for row in rows.values())


USED = {
    "test_program_uses_each_service": [0, 1, 2, 3, 4, 5, 8, 10, 11, 12, 13, 14, 20, 22, 24, 25, 26, 31, 32, 44, 45, 50],
    "test_bounds_select_what_overlaps_them_and_not_only_origins": [6],
    "test_flat_hull_selects_shapes_that_it_cuts": [7],
    "test_reset_has_time_and_state_of_its_own": [21],
    "test_reset_of_state_keeps_what_was_spawned": [23],
    "test_steps_have_feedback_and_can_be_cancelled": [33],
    "test_other_trial_is_loaded_as_world_and_the_node_stays": [40, 43],
    "test_world_is_loaded_by_name_or_text": [41],
    "test_worlds_are_trials": [42],
}
"""Features that a test uses, by its name."""


def test_each_feature_is_used_by_a_test() -> None:
    ours = OF_TIME | OF_ENTITIES | OF_WORLDS | OF_LOADING
    assert set().union(*USED.values()) == ours
    tests = Path(__file__).parents[1]
    files = [tests / "ros2" / "test_simulation.py", *(tests / "viewer" / "services").glob("test_*.py")]
    text = "".join(path.read_text() for path in files)
    assert [name for name in USED if f"def {name}(" not in text] == []
