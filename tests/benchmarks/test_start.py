"""A cold start, once."""

import math

import pytest

from benchmarks.start import STEPS, measure, run_python
from cellwright.util.errors import UsageError


@pytest.mark.slow
def test_start_shares_add_up_to_total() -> None:
    progress: list[str] = []
    figures = {figure.label: figure for figure in measure(progress.append, quick=True)}
    assert progress == ["1 programs", "1 commands"]
    shares = [figures[f"of that: {label}"].value for label in STEPS]
    assert sum(shares) / 1e3 == pytest.approx(figures["process until its first step"].value)
    assert min(shares) >= 0.0
    memory = figures["resident memory after it"]
    assert math.isnan(memory.value) or (memory.value > 20.0 and memory.maximum == 200.0)


def test_failing_process_is_reported_with_output() -> None:
    with pytest.raises(UsageError, match="no luck"):
        run_python("-c", "raise SystemExit('no luck')")
