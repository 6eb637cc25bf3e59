"""JUnit file of an evaluation, for CI services: a test case for each run, with the evidence of its points."""

import re
from collections.abc import Iterator, Sequence
from xml.etree import ElementTree

from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import (
    Repeat,
    Threshold,
    kit_words,
    mean_share,
    measure_rows,
    passed_count,
    passed_interval,
    range_text,
    share_interval,
    shortcoming,
    summarize,
)
from cellwright.util.errors import printable

_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that an XML file cannot hold in any form."""


def junit(results: Sequence[Result], threshold: Threshold | None, repeats: Sequence[Repeat] = ()) -> bytes:
    """Return the JUnit file: a test case for each run and each repetition, in a class for each trial."""
    short = [shortcoming(result, threshold) for result in results]
    differences = [repeat.difference for repeat in repeats]
    skipped = sum(result.is_unjudged for result in results)
    failures = sum(map(bool, [*short, *differences])) - skipped
    tests = len(results) + len(repeats)
    counts = {"tests": str(tests), "failures": str(failures), "errors": "0", "skipped": str(skipped)}
    wall = sum(result.wall for result in [*results, *(repeat.second for repeat in repeats)])
    times = {"time": f"{wall:.3f}"}
    suites = ElementTree.Element("testsuites", counts | times)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": "cellwright eval", **counts, **times})
    properties = ElementTree.SubElement(suite, "properties")
    for name, value in _properties(results, threshold):
        ElementTree.SubElement(properties, "property", {"name": _clean(name), "value": value})
    for result, reason in zip(results, short, strict=True):
        _add_case(suite, result, reason)
    for repeat, difference in zip(repeats, differences, strict=True):
        _add_case(suite, repeat.second, f"not repeatable: {difference}" if difference else "", " repeated")
    ElementTree.indent(suites)
    return bytes(ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True))


def _properties(results: Sequence[Result], threshold: Threshold | None) -> Iterator[tuple[str, str]]:
    """Yield names and values of the figures over many runs: shares in percent, means in points."""
    if (share := mean_share(results)) is not None:
        passed, count = passed_count(results, threshold)
        yield "share", f"{share:.1%}"
        yield "share, 95 % interval", range_text(share_interval(results), 100.0, " %")
        yield "passed", f"{passed} of {count}"
        yield "passed, 95 % interval", range_text(passed_interval(results, threshold), 100.0, " %")
    for each in summarize(results, threshold):
        if each.share is None:
            yield each.trial, "not judged: no order with points to earn"
            continue
        yield f"{each.trial}: mean", f"{each.mean:.4g}"
        yield f"{each.trial}: mean, 95 % interval", range_text(each.mean_interval)
        yield f"{each.trial}: passed", f"{each.passed} of {each.runs}"
        yield f"{each.trial}: passed, 95 % interval", range_text(each.passed_interval, 100.0, " %")
        for _, label, mean, interval, spread in measure_rows([each]):
            yield f"{each.trial}: {label}", mean
            yield f"{each.trial}: {label}, 95 % interval", interval
            yield f"{each.trial}: {label}, spread", spread


def _add_case(suite: ElementTree.Element, result: Result, reason: str, suffix: str = "") -> None:
    name = f"seed {result.seed}{' varied' if result.vary else ''}{suffix}"
    case = ElementTree.SubElement(
        suite, "testcase", {"classname": _clean(result.trial), "name": name, "time": f"{result.wall:.3f}"}
    )
    evidence = "\n".join(_evidence_lines(result))
    if reason and result.is_unjudged and not suffix:
        ElementTree.SubElement(case, "skipped", {"message": _clean(f"not judged: {reason}")})
    elif reason:
        failure = ElementTree.SubElement(case, "failure", {"message": _clean(reason), "type": _clean(result.outcome)})
        failure.text = _clean(evidence)
    ElementTree.SubElement(case, "system-out").text = _clean(evidence)
    if result.log:
        ElementTree.SubElement(case, "system-err").text = _clean("\n".join(result.log))


def _evidence_lines(result: Result) -> Iterator[str]:
    """Yield how a run ended and what it earned; a line for each ordered part and for each object without use."""
    yield f"{result.ending}: {result.points:g} of {result.reachable:g} points"
    for order in result.score.get("orders", ()):
        for kit in order["kits"]:
            yield f"{order['order_id']}, kit {kit['kit_type']}: {kit_words(kit)}"
            for part in kit["parts"]:
                yield f"  {part['presence'] + part['pose']:g} of 2  {part['type']}: {part['sentence']}"
            for extra in kit["extras"]:
                yield f"  extra: {extra['name']} ({extra['reason']})"


def _clean(text: str) -> str:
    """Return a text that XML can hold, and that no log of a CI service obeys."""
    return printable(_FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text), len(text))
