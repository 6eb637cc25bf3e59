from pathlib import Path

from cellwright.robot.interface import IO_TELEOP
from tools.robot_node_page import BEGIN, END, renewed, tables

PAGE = Path(__file__).parents[2] / "docs" / "robot-node.md"


def test_robot_node_page_is_up_to_date() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert BEGIN in text
    assert END in text
    assert text == renewed(text), "run: python -m tools.robot_node_page docs/robot-node.md"


def test_interface_row_is_on_page_once() -> None:
    lines = tables().splitlines()
    for row in IO_TELEOP:
        (line,) = [line for line in lines if line.startswith(f"| `{row.name}` |")]
        assert row.type in line
        assert row.rate_text in line
        assert row.about in line
        assert row.source in line


def test_tables_have_equal_column_counts() -> None:
    for table in tables().split("**")[2::2]:
        assert len({line.count("|") for line in table.splitlines() if line}) == 1
