from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from collections import Counter

import pytest

from benchmarks.soak.memory import Sample
from benchmarks.soak.report import has_passed, lines, picture
from benchmarks.soak.soak import SoakResult

SVG = "{http://www.w3.org/2000/svg}"


def soaked(*, slope: float = 0.0, pieces: dict[int, str] | None = None, memory: float = 80.0) -> SoakResult:
    samples = [Sample(number / 100, memory + slope * number / 100) for number in range(1, 101)]
    same = {50: "aa", 100: "bb"}
    return SoakResult(
        "cell", 100, 12.3, samples, same, same if pieces is None else pieces, Counter({"AGVs sent": 1234})
    )


def test_report_of_steady_run_lists_its_figures() -> None:
    run = soaked()
    run.grown, run.max_growth = -1.5, ("+1.0 KiB bus.py:3",)
    text = "\n".join(lines(run))
    assert has_passed(run)
    assert text.startswith("cell: 1 simulated hours in one process, 12 s")
    for words in ("1,234", "80.0 MiB early, 80.0 MiB late: steady", "-1.5 KiB", "bus.py:3", "the same in 2 pieces"):
        assert words in text


@pytest.mark.parametrize(
    ("run", "words"),
    [
        (soaked(slope=20.0), "GROWS by more than 4 MiB"),
        (soaked(pieces={50: "aa", 100: "cc"}), "DIFFERS between one piece and 2, first at round 100"),
    ],
)
def test_report_names_growth_or_difference(run: SoakResult, words: str) -> None:
    assert not has_passed(run)
    assert words in "\n".join(lines(run))


def test_report_without_memory_figures_says_so() -> None:
    run = soaked(memory=math.nan)
    assert has_passed(run)
    assert "not reported by this system" in "\n".join(lines(run))
    ET.fromstring(picture([run]))


def test_picture_has_one_curve_per_run() -> None:
    root = ET.fromstring(picture([soaked(), soaked(slope=3.0)]))
    curves = [path for path in root.iter(f"{SVG}path") if "stroke: #1f5fa8" in path.attrib.get("style", "")]
    assert len(curves) == 2
    heights = [
        [float(y) for y in re.findall(r"[ML] \S+ (\S+)", curve.attrib["d"])] for curve in curves
    ]  # a steady line is flat, and 3 MiB of some 10 are visible as such
    assert max(heights[0]) - min(heights[0]) < 0.2
    assert 30 < max(heights[1]) - min(heights[1]) < 60
