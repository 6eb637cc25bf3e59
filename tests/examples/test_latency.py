"""Example of a latency: its policy picks the gear from a fast belt, and by its latency alone fails to."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.ports import free_port

FOLDER = Path(__file__).parents[2] / "examples" / "latency"
GEAR = 39.0
"""Radius of the gear [mm]."""


@pytest.fixture
def curve(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Any]:
    """The program that draws the curve, with an own port and folder."""
    monkeypatch.syspath_prepend(str(FOLDER))
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module("curve")
    monkeypatch.setattr(module, "PORT", free_port())
    yield module
    for name in ("curve", "picker"):
        del sys.modules[name]


@pytest.mark.slow
def test_latency_alone_makes_the_policy_fail_on_a_fast_belt(
    curve: Any, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(curve, "LATENCIES", (0, 240))
    monkeypatch.setattr(curve, "SPEEDS", (0.4,))
    summary = curve.evaluate("1")
    runs = {each["overrides"]["latency_ms"]: each for each in summary["results"]}
    assert {latency: run["success"] for latency, run in runs.items()} == {"0": True, "240": False}
    on_time, late = (1000.0 * curve.miss(runs[latency]["key"]) for latency in ("0", "240"))
    assert abs(on_time) < GEAR
    # an answer acts 250 ms after its picture, and until the next one does; the servos lag by less than 100 ms
    assert 0.4 * 250 < late < 0.4 * (2 * 250 + 100)
    curve.draw(summary)
    assert "0.4 m/s: 100 % and" in capsys.readouterr().out
    assert Path("latency.svg").read_text().count("latency [ms]")
