"""Results as a JUnit file, which every CI service knows how to show."""

from __future__ import annotations

import re
from collections.abc import Sequence
from xml.etree import ElementTree

from cellwright.running.evaluation.evidence_lines import evidence_lines
from cellwright.running.evaluation.result import Result
from cellwright.running.evaluation.summary import Threshold, shortcoming

_FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""What cannot stand in an XML file, in any form."""


def junit(results: Sequence[Result], threshold: Threshold | None) -> bytes:
    """The file: a test case for each run, of the class of its trial."""
    short = [shortcoming(result, threshold) for result in results]
    counts = {"tests": str(len(results)), "failures": str(sum(map(bool, short))), "errors": "0", "skipped": "0"}
    times = {"time": f"{sum(result.wall for result in results):.3f}"}
    suites = ElementTree.Element("testsuites", counts | times)
    suite = ElementTree.SubElement(suites, "testsuite", {"name": "cellwright eval", **counts, **times})
    for result, why in zip(results, short, strict=True):
        _add_case(suite, result, why)
    ElementTree.indent(suites)
    return bytes(ElementTree.tostring(suites, encoding="utf-8", xml_declaration=True))


def _add_case(suite: ElementTree.Element, result: Result, why: str) -> None:
    name = f"seed {result.seed}{' varied' if result.vary else ''}"
    case = ElementTree.SubElement(
        suite, "testcase", {"classname": _clean(result.trial), "name": name, "time": f"{result.wall:.3f}"}
    )
    evidence = "\n".join(evidence_lines(result))
    if why:
        failure = ElementTree.SubElement(case, "failure", {"message": _clean(why), "type": result.outcome})
        failure.text = _clean(evidence)
    ElementTree.SubElement(case, "system-out").text = _clean(evidence)
    if result.log:
        ElementTree.SubElement(case, "system-err").text = _clean("\n".join(result.log))


def _clean(text: str) -> str:
    return _FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", text)
