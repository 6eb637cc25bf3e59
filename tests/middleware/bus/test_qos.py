"""Quality of service of topics."""

import pytest

from cellwright.middleware.bus.qos import BEST_EFFORT_COMMANDS, COMMANDS, LARGE, LATCHED, RELIABLE, Qos


@pytest.mark.parametrize(
    ("qos", "text"),
    [
        (RELIABLE, "reliable, depth 10"),
        (LATCHED, "reliable, transient local, depth 1"),
        (COMMANDS, "reliable, depth 1000"),
        (BEST_EFFORT_COMMANDS, "best effort, depth 1000"),
        (LARGE, "reliable, depth 2"),
    ],
)
def test_text_has_reliability_durability_and_depth(qos: Qos, text: str) -> None:
    assert qos.text == text
