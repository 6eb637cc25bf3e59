"""Inputs that are YAML, changed as trees."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import yaml

from fuzz.trees import mutated

_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_DUMPER: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)


def mutate(data: bytes, chance: random.Random, words: Sequence[str]) -> bytes | None:
    """Return the document with changes in it; None if it cannot be changed."""
    try:
        tree = yaml.load(data.decode("utf-8"), _LOADER)
        return text(mutated(tree, chance, words))
    except (yaml.YAMLError, ValueError, RecursionError, TypeError, OverflowError):
        return None


def text(tree: object) -> bytes:
    """Return a tree as YAML."""
    return yaml.dump(tree, Dumper=_DUMPER, allow_unicode=True, sort_keys=False).encode("utf-8", "replace")
