"""Checks of `cellwright teleop`: of a robot's motion (`--check`) and of a driver (`--check-driver`)."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from cellwright.cli import options
from cellwright.cli.main import DONE, NOT_DONE
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.driver import check_driver
from cellwright.robot.checks.reference import MAX_RANGE_ERROR, MAX_TIME_ERROR
from cellwright.robot.checks.rig import Finding, MotionReport
from cellwright.robot.drivers import find_driver
from cellwright.util.errors import UsageError


def run_driver_check(driver: str | None, load: Callable[[Callable[[str], None]], RobotConfig]) -> int:
    """Try a driver out, and print what was found, a line each.

    Args:
        driver: where its class stands.
        load: gives the robot; takes what is told of warnings.

    Returns:
        The exit status.

    Raises:
        UsageError: there is no driver to try.
    """
    if driver is None:
        options.refuse("--check-driver: name the driver: --driver my_driver.py:MyDriver")
    make = find_driver(driver)
    problems = check_driver(make, load(partial(typer.echo, err=True)))
    for problem in problems:
        typer.echo(f"{driver}: {problem}")
    if not problems:
        typer.echo("ok")
    return NOT_DONE if problems else DONE


_PERCENT = (
    f"%: of a step's way, a sine's swing, a gripper's travel\n"
    f"   steps and sines may be off by {100 * MAX_RANGE_ERROR:g} %, or be {1e3 * MAX_TIME_ERROR:.0f} ms early or late"
)


def refuse_what_runs(given: Mapping[str, bool]) -> None:
    """Refuse what is meant for a node that goes on running.

    Args:
        given: for each option whether it is given.

    Raises:
        UsageError: one is.
    """
    for name, is_given in given.items():
        if is_given:
            raise UsageError(f"--check: leave out {name}, meant for a node that goes on running")


def tell_motion_report(report: MotionReport, *, as_json: bool) -> int:
    """Print how a robot moves; the exit status: 0 when all is well, else 1."""
    if as_json:
        typer.echo(json.dumps(motion_document(report), indent=2))
    else:
        show_motion_report(Console(highlight=False), report)
    return DONE if report.passed else NOT_DONE


def show_motion_report(console: Console, report: MotionReport) -> None:
    """Print a row for each finding, and what they come to."""
    against = (
        f"against its recorded motion, {Path(report.reference).name}"
        if report.reference
        else "joint by joint: it has no recorded motion"
    )
    console.print(f"{report.robot} in its node, {against}", markup=False, soft_wrap=True)
    console.print()
    console.print(findings_table(report))
    if report.reference:
        console.print(_PERCENT, markup=False)
    for finding in report.findings:
        if finding.note and finding.passed:
            console.print(f"  {finding.what}: {finding.note}", markup=False, soft_wrap=True)
        if finding.remedy:
            console.print(f"  {finding.what}: {finding.remedy}", markup=False, soft_wrap=True)
    good = sum(finding.passed for finding in report.findings)
    console.print()
    console.print(f"passed      {good} of {len(report.findings)}", markup=False)


def findings_table(report: MotionReport) -> Table:
    """A row for each finding."""
    found = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False)
    found.add_column("looked at", overflow="fold")
    for heading in ("worst", "limit"):
        found.add_column(heading, justify="right", no_wrap=True)
    found.add_column("where", overflow="fold")
    found.add_column("", no_wrap=True)
    for finding in report.findings:
        verdict = Text("ok", style="green") if finding.passed else Text("FAILS", style="bold red")
        found.add_row(Text(finding.what), _figure(finding), _limit(finding), Text(finding.where), verdict)
    return found


def motion_document(report: MotionReport) -> dict[str, Any]:
    """The report as JSON values; a figure that does not exist is null."""
    findings = [asdict(finding) for finding in report.findings]
    for finding in findings:
        if not math.isfinite(finding["worst"]):
            finding["worst"] = None
    return {"robot": report.robot, "reference": report.reference or None, "passed": report.passed, "findings": findings}


def _figure(finding: Finding) -> str:
    if not math.isfinite(finding.worst):
        return "-"
    return f"{finding.worst:.0f}" if finding.unit == "differ" else f"{finding.worst:.2f}"


def _limit(finding: Finding) -> str:
    return f"{finding.limit:.3g} {finding.unit}"
