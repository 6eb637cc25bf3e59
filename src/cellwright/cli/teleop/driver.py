"""`cellwright teleop --check-driver`: a driver of one's own, tried out."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import typer

from cellwright.cli import options
from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.config.robot.config import RobotConfig
from cellwright.robot.checks.driver import check_driver
from cellwright.robot.drivers.own import find_driver


def run_check(driver: str | None, load: Callable[[Callable[[str], None]], RobotConfig]) -> int:
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
