"""Parameters of commands: arguments, options and flags, and groups of them that several commands share."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import wraps
from inspect import Parameter, signature
from typing import Any, get_type_hints

import typer


def argument(metavar: str, text: str) -> Any:
    """Declare a positional argument."""
    return typer.Argument(metavar=metavar, help=text, show_default=False)


def option(metavar: str, text: str, panel: str | None = None, name: str | None = None) -> Any:
    """Declare an option that takes a value; without a `name`, such as `--video`, it has that of the parameter."""
    return typer.Option(*([name] if name else []), metavar=metavar, help=text, rich_help_panel=panel)


def flag(names: str, text: str, panel: str | None = None) -> Any:
    """Declare an option without a value; names are separated by spaces, such as `--development-mode -d`."""
    return typer.Option(*names.split(), metavar="", help=text, rich_help_panel=panel)


def with_groups(command: Callable[..., None]) -> Callable[..., None]:
    """Return a command as typer reads it: each field of a group is a parameter of its own.

    A group is a parameter whose type is a dataclass. Its fields are declared as a command's parameters are, or are
    groups themselves. Names of fields are unique in a command.

    Example:
        >>> from dataclasses import dataclass
        >>> @dataclass(frozen=True)
        ... class Window:
        ...     title: str = "cell"
        ...     width: int = 640
        >>> @with_groups
        ... def show(window: Window) -> None:
        ...     print(window)
        >>> show(title="robot", width=800)
        Window(title='robot', width=800)
    """
    declared = signature(command, eval_str=True)
    types = {name: each.annotation for name, each in declared.parameters.items()}

    @wraps(command)
    def ungrouped(**values: Any) -> None:
        command(**{name: _value(name, kind, values) for name, kind in types.items()})

    flat = [each for name, given in declared.parameters.items() for each in _flat(name, types[name], given.default)]
    # typer asks `inspect.signature`, which takes this attribute in place of the wrapper's own parameters
    vars(ungrouped)["__signature__"] = declared.replace(parameters=flat)
    return ungrouped


def _flat(name: str, kind: Any, default: Any) -> Iterator[Parameter]:
    """Yield the parameter, or those of the fields of a group."""
    if not is_dataclass(kind):
        yield Parameter(name, Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        return
    for each, of_field in _fields(kind):
        yield from _flat(each.name, of_field, Parameter.empty if each.default is MISSING else each.default)


def _value(name: str, kind: Any, values: Mapping[str, Any]) -> Any:
    """Return the value of a parameter, or a group of the values of its fields."""
    if not isinstance(kind, type) or not is_dataclass(kind):
        return values[name]
    return kind(**{each.name: _value(each.name, of_field, values) for each, of_field in _fields(kind)})


def _fields(kind: Any) -> Iterator[tuple[Any, Any]]:
    types = get_type_hints(kind, include_extras=True)
    return ((each, types[each.name]) for each in fields(kind))
