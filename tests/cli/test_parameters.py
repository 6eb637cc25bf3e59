"""Tests of parameters of commands, and of groups of them."""

from dataclasses import dataclass
from inspect import signature
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from cellwright.cli.parameters import argument, flag, option, with_groups


@dataclass(frozen=True)
class Size:
    width: Annotated[int, option("W", "Width.")] = 640
    height: Annotated[int, option("H", "Height.")] = 480


@dataclass(frozen=True, kw_only=True)
class Window:
    title: Annotated[str, argument("TITLE", "Title.")]
    size: Size
    is_open: Annotated[bool, flag("--open -o", "Open it.")] = False


@with_groups
def show(window: Window, scale: Annotated[float, option("F", "Factor.")] = 1.0) -> None:
    """Show a window."""
    typer.echo(repr((window, scale)))


def test_fields_of_nested_groups_are_parameters_in_their_order() -> None:
    assert list(signature(show).parameters) == ["title", "width", "height", "is_open", "scale"]
    assert signature(show).parameters["width"].default == 640


def test_command_receives_groups_of_its_options() -> None:
    app = typer.Typer()
    app.command()(show)
    ran = CliRunner().invoke(app, ["cell", "--height", "600", "-o", "--scale", "2"])
    assert ran.output == f"{(Window(title='cell', size=Size(640, 600), is_open=True), 2.0)!r}\n"


@pytest.mark.parametrize("words", [[], ["cell", "--width", "wide"]])
def test_missing_and_invalid_values_of_fields_are_refused(words: list[str]) -> None:
    app = typer.Typer()
    app.command()(show)
    assert CliRunner().invoke(app, words).exit_code == 2
