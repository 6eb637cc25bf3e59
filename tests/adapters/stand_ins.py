"""Stand-ins for packages that adapters are made for: each name of them is a record of what it was called with."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any
from unittest import mock


class Record:
    """A call of a stand-in, with its arguments.

    Attributes:
        args: those without a name; each of the others is an attribute.
    """

    def __init__(self, *args: Any, **named: Any) -> None:
        self.args = args
        self.__dict__.update(named)


class _StandIn(ModuleType):
    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        made = type(name, (Record,), {})
        setattr(self, name, made)
        return made


@contextmanager
def imported(adapter: str, *modules: str) -> Iterator[Any]:
    """Import an adapter with stand-ins for modules of another package, and forget all of them afterwards."""
    with mock.patch.dict(sys.modules, {name: _StandIn(name) for name in modules}):
        sys.modules.pop(adapter, None)
        yield importlib.import_module(adapter)
