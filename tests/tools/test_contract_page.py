from pathlib import Path

from cellwright.cell.interface.rows import GEAR, rows
from cellwright.config.trial.trial import Trial
from tools.contract_page import contract_page, markdown

PAGE = Path(__file__).parents[2] / "docs" / "contract.md"


def test_contract_page_is_up_to_date() -> None:
    command = "python -m tools.contract_page > docs/contract.md"
    assert PAGE.read_text(encoding="utf-8") == contract_page(), f"run: {command}"


def test_interface_row_is_on_page() -> None:
    lines = contract_page().splitlines()
    for row in GEAR:
        matching = [line for line in lines if line.startswith(f"| `{row.name}` | `{row.type}` |")]
        assert any(row.rate_text in line and row.where.text in line and row.about in line for line in matching), row


def test_tables_have_equal_column_counts() -> None:
    width = 0
    for line in contract_page().splitlines():
        if not line.startswith("|"):
            width = 0
        elif width:
            assert line.count("|") == width, line
        else:
            width = line.count("|")


def test_rows_of_one_cell_have_rate_latch_and_qos() -> None:
    text = markdown(rows(Trial(""), competition=True))
    assert "| `/ariac/agv1/state` | `std_msgs/String` | each step |  | reliable, depth 10 | for each AGV |" in text
    assert (
        "| `/ariac/orders` | `osrf_gear/Order` | on event | yes | reliable, transient local, depth 1 | always |" in text
    )
    assert "## Actions" not in text
    assert "/ariac/arm/command" not in text
    assert "| `/cellwright/intention` | `std_msgs/String` | reliable, depth 1000 | always |" in text
    assert "population" not in text
