"""Things of other packages at work: what they raise ends the run with a reason that says whose it is."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, TypeVar

from cellwright.util.errors import RunEndedError, SimulationError, in_a_line
from cellwright.util.plugins.entry_points import Kind, refusal

T = TypeVar("T")


class PluginFailedError(SimulationError):
    """Something of another package failed while it was at work: what the run says from then on is worth nothing."""


def guard(thing: T, kind: Kind, name: str, methods: Iterable[str]) -> T:
    """Have what its methods raise come out as a PluginFailedError.

    Args:
        thing: an object of another package's class, which is changed and given back.
        kind: what it is.
        name: the name by which the package brings it along.
        methods: those that are called while it is at work; they are to be there.
    """
    for method in methods:
        setattr(thing, method, partial(call, kind, name, getattr(thing, method)))
    return thing


def call(kind: Kind, name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call a function of another package.

    Raises:
        PluginFailedError: it has raised something.
    """
    try:
        return function(*arguments)
    except (SimulationError, RunEndedError, KeyboardInterrupt):  # the engine's, or another thing's that it has called
        raise
    except BaseException as error:  # one that says exit would be taken for the agent, which may end so
        what = f"failed in {getattr(function, '__name__', 'it')}: {in_a_line(error)}"
        raise PluginFailedError(str(refusal(kind, name, what))) from error
