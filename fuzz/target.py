"""Fuzzing targets by name."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pkgutil import iter_modules

import fuzz.targets


@dataclass(frozen=True)
class Target:
    """A reader under attack; see `fuzz.targets` for what its module has."""

    name: str
    about: str
    attempt: Callable[[bytes], None]
    seeds: Callable[[], Iterator[bytes]]
    words: tuple[str, ...]
    max_size: int
    mutate: Callable[[bytes, random.Random], bytes | None] | None


def names() -> list[str]:
    """Return the names of all targets."""
    return sorted(module.name for module in iter_modules(fuzz.targets.__path__))


def find(name: str) -> Target:
    """Return the target of a name; its reader is imported now."""
    module = import_module(f"fuzz.targets.{name}")
    about = (module.__doc__ or "").splitlines()[0]
    mutate = getattr(module, "mutate", None)
    return Target(name, about, module.attempt, module.seeds, tuple(module.WORDS), module.MAX_SIZE, mutate)
