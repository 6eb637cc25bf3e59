"""Checks of `cellwright teleop`: a robot's motion, and a driver."""

import json
import math
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import typer
from rich.console import Console
from rich.text import Text

from cellwright.cli import output
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.output import echo
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.driver import check_driver
from cellwright.robot.checks.motion import check_motion
from cellwright.robot.checks.reference import MAX_RANGE_ERROR, MAX_TIME_ERROR
from cellwright.robot.checks.rig import Finding, MotionReport
from cellwright.robot.drivers import find_driver
from cellwright.robot.node import RobotNode

_PERCENT = (
    f"%: of a step's height, a sine's swing, a gripper's travel\n"
    f"   tolerance of steps and sines: {100 * MAX_RANGE_ERROR:g} %, or {1e3 * MAX_TIME_ERROR:.0f} ms early or late"
)


def run_motion_check(node: RobotNode, console: Console, *, as_json: bool) -> int:
    """Check the motion of a robot in its node, print the report, and close the node; return the exit status."""
    with closing(node):
        report = check_motion(node)
    if as_json:
        typer.echo(json.dumps(motion_document(report), indent=2))
    else:
        show_motion_report(console, report)
    return DONE if report.passed else NOT_DONE


def run_driver_check(driver: str, load: Callable[[Callable[[str], None]], RobotConfig]) -> int:
    """Check a driver, and print each finding in a line; return the exit status."""
    make = find_driver(driver)
    problems = check_driver(make, load(partial(typer.echo, err=True)))
    for problem in problems:
        echo(f"{driver}: {problem}")
    if not problems:
        typer.echo("ok")
    return NOT_DONE if problems else DONE


def show_motion_report(console: Console, report: MotionReport) -> None:
    """Print a row for each finding, and a summary."""
    recorded = f"compared with its recorded motion, {Path(report.reference).name}"
    against = recorded if report.reference else "joint by joint, since it has no recorded motion"
    output.print_line(console, f"{report.robot} in its node, {against}")
    console.print()
    print_table(console, findings_table(report))
    if report.reference:
        console.print(_PERCENT, markup=False)
    for finding in report.findings:
        if finding.note and finding.passed:
            output.print_line(console, f"  {finding.what}: {finding.note}")
        if finding.remedy:
            output.print_line(console, f"  {finding.what}: {finding.remedy}")
    good = sum(finding.passed for finding in report.findings)
    console.print()
    console.print(f"passed      {good} of {len(report.findings)}", markup=False)


def findings_table(report: MotionReport) -> FittedTable:
    """Return a table with a row for each finding."""
    rows = []
    for finding in report.findings:
        verdict = Text("ok", style="green") if finding.passed else Text("FAILS", style="bold red")
        limit = f"{finding.limit:.3g} {finding.unit}"
        rows.append((Text(finding.what), _figure(finding), limit, Text(finding.where), verdict))
    return table({"check": FOLD, "worst": RIGHT, "limit": RIGHT, "where": FOLD, "": WHOLE}, rows)


def motion_document(report: MotionReport) -> dict[str, Any]:
    """Return the report as JSON values; a figure that does not exist is null."""
    findings = [asdict(finding) for finding in report.findings]
    for finding in findings:
        if not math.isfinite(finding["worst"]):
            finding["worst"] = None
    return {"robot": report.robot, "reference": report.reference or None, "passed": report.passed, "findings": findings}


def _figure(finding: Finding) -> str:
    if not math.isfinite(finding.worst):
        return "-"
    return f"{finding.worst:.0f}" if finding.unit == "differ" else f"{finding.worst:.2f}"
