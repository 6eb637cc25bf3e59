"""Tests of the picture of a sweep."""

from __future__ import annotations

import re
from xml.etree import ElementTree

import pytest

from cellwright.running.evaluation.outputs.report import report
from cellwright.running.evaluation.outputs.sweep_picture import sweep_picture
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import summarize
from tests.running.evaluation.made_results import result, worked


def runs(trial: str = "lesson", seeds: int = 4, **values: list[str]) -> list[Result]:
    """Return runs of a trial with values of one key: each has fewer points than the one before, with a spread."""
    ((key, listed),) = values.items()
    return [
        worked(
            max(0.0, 12.0 - 3.0 * number - seed % 2),
            trial=f"{trial} {key}={value}",
            seed=seed,
            simulated=20.0 + seed,
            overrides={key: value},
        )
        for number, value in enumerate(listed)
        for seed in range(1, seeds + 1)
    ]


def picture(results: list[Result]) -> ElementTree.Element:
    """Return the picture, which is XML."""
    return ElementTree.fromstring(f"<div>{sweep_picture(summarize(results))}</div>")


def dots(root: ElementTree.Element) -> list[tuple[float, float, str]]:
    """Return x and y of the dots [px], and their titles."""
    return [(float(dot.attrib["cx"]), float(dot.attrib["cy"]), "".join(dot.itertext())) for dot in root.iter("circle")]


def test_dots_stand_at_values_and_shares_with_intervals() -> None:
    root = picture(runs(speed=["0.5", "1", "2.0"]))
    found = dots(root)
    (left, top, title), (middle, _, _), (right, bottom, _) = found
    assert (right - middle) / (middle - left) == pytest.approx(2.0, abs=0.01)
    assert top < bottom
    assert re.fullmatch(r"lesson speed=0\.5: 95\.8% of the attainable points, 95 %: .* to .* %; 4 runs", title)
    whiskers = [line for line in root.iter("line") if "whisker" in line.attrib["class"]]
    assert len(whiskers) == 9
    assert float(whiskers[0].attrib["y1"]) > top > float(whiskers[0].attrib["y2"])
    words = [text.text for text in root.iter("text")]
    assert words == ["0 %", "25 %", "50 %", "75 %", "100 %", "0.5", "1", "2.0", "speed"]


def test_order_of_values_on_axis_is_theirs_and_not_that_of_the_runs() -> None:
    found = dots(picture(runs(speed=["3", "-1", "pi/2"])))
    assert [title.partition(":")[0] for *_, title in found] == [
        "lesson speed=-1",
        "lesson speed=pi/2",
        "lesson speed=3",
    ]
    assert sorted(x for x, *_ in found) == [x for x, *_ in found]


def test_axis_of_several_orders_of_magnitude_is_logarithmic() -> None:
    first, second, third = (x for x, *_ in dots(picture(runs(noise=["0.001", "0.01", "0.1"]))))
    assert second - first == pytest.approx(third - second, abs=0.2)


def test_labels_that_would_overlap_are_left_out() -> None:
    words = [text.text for text in picture(runs(speed=["0", "1", "100"])).iter("text")]
    assert words[5:] == ["0", "100", "speed"]


def test_several_trials_have_a_curve_each_and_a_name_in_the_legend() -> None:
    root = picture([*runs("lesson", speed=["1", "2"]), *runs("final <1>", speed=["1", "2"])])
    assert [line.attrib["class"] for line in root.iter("polyline")] == ["curve s0", "curve s1"]
    legend = "".join(next(root.iter("p")).itertext())
    assert legend == "lessonfinal <1>dots: share of the attainable points; bars: 95 % interval"


def test_runs_without_interval_have_dots_alone() -> None:
    root = picture(runs(speed=["1", "2"], seeds=1))
    assert (len(dots(root)), [line for line in root.iter("line") if "whisker" in line.attrib["class"]]) == (2, [])
    assert "interval" not in "".join(root.itertext())


@pytest.mark.parametrize(
    "results",
    [
        [],
        [result(), result(seed=2)],
        runs(speed=["1"]),
        runs(servo=["original", "precise"]),
        runs(pose=["[0, 1]", "[0, 2]"]),
        [*runs(speed=["1", "2"]), result()],
        [result(trial=f"t a={a} b={b}", overrides={"a": a, "b": b}) for a in "12" for b in "12"],
        [each for name in "abcde" for each in runs(name, speed=["1", "2"])],
    ],
    ids=["none", "no sweep", "one value", "words", "lists", "only some", "two keys", "five trials"],
)
def test_other_sweeps_have_no_picture(results: list[Result]) -> None:
    assert sweep_picture(summarize(results)) == ""
    assert " against " not in report(results, None)


def test_report_shows_picture() -> None:
    results = [result(trial=f"lesson a={value} b=7", overrides={"a": value, "b": "7"}) for value in ("1", "2")]
    assert "<h2>Share of the attainable points against a</h2>" in report(results, None)
    assert "".join(picture(results).itertext()).endswith("lessondots: share of the attainable points")


def test_success_of_a_task_against_latency_is_named_so() -> None:
    results = [
        result(
            float(value != "120"),
            trial=f"pick latency_ms={value}",
            reachable=1.0,
            success=value != "120",
            overrides={"latency_ms": value},
        )
        for value in ("0", "60", "120")
    ]
    root = picture(results)
    assert [heading.text for heading in root.iter("h2")] == ["Success rate against latency [ms]"]
    assert next(root.iter("svg")).attrib["aria-label"] == "success rate against latency [ms]"
    assert [text.text for text in root.iter("text")][-1] == "latency [ms]"
    assert dots(root)[0][2] == "pick latency_ms=0: 100.0% of the runs succeeded; 1 run"
    assert "".join(root.itertext()).endswith("pickdots: success rate")
