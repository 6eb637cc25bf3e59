"""Version and folder of the package, and its former names, for modules that would otherwise import the root."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Callable
from typing import Any

VERSION = "0.2.0"
FOLDER = os.path.dirname(os.path.abspath(__file__))
"""Absolute path of the folder `cellwright`."""


def former_names(module: str, **present: str) -> Callable[[str], Any]:
    """Return a `__getattr__` for a module: names of version 0.1 give the present ones, with a DeprecationWarning.

    Args:
        module: name of the module.
        present: present name, by former name.
    """

    def find(name: str) -> Any:
        if name not in present:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        warnings.warn(f"{module}.{name} is deprecated; use {present[name]}", DeprecationWarning, stacklevel=2)
        return getattr(sys.modules[module], present[name])

    return find
