"""Changes to a configuration as a tree: random bytes seldom remain YAML."""

from __future__ import annotations

import copy
import random
from collections.abc import Iterator, Sequence
from typing import Any, TypeAlias

from fuzz.values import ALL

Holder: TypeAlias = dict[Any, Any] | list[Any]
Spot: TypeAlias = tuple[Holder, Any]
"""A mapping or list, and the key or number of one of its values."""

MAX_VALUES = 3000
"""Size from which a tree is reset to its origin, so that a search does not get slower and slower."""


def mutated(tree: object, chance: random.Random, words: Sequence[str], *, max_changes: int = 4) -> object:
    """Return a copy of a tree with one or more changes in it.

    Args:
        tree: mappings, lists and values, as YAML has them.
        chance: source of the changes; the same state makes the same tree.
        words: the reader's keys, for entries that are renamed or added.
        max_changes: largest number of changes.
    """
    changed: list[object] = [copy.deepcopy(tree)]
    for _ in range(chance.randint(1, max_changes)):
        spots = list(_spots(changed))
        if len(spots) > MAX_VALUES:
            changed = [copy.deepcopy(tree)]
            continue
        _change(chance.choice(spots), spots, chance, words)
    return changed[0]


def _spots(holder: Holder) -> Iterator[Spot]:
    entries = list(holder.items()) if isinstance(holder, dict) else list(enumerate(holder))
    for key, value in entries:
        yield holder, key
        if isinstance(value, dict | list):
            yield from _spots(value)


def _change(spot: Spot, spots: Sequence[Spot], chance: random.Random, words: Sequence[str]) -> None:
    holder, key = spot
    value = holder[key]
    match chance.randint(0, 9):
        case 0 | 1 | 2:
            holder[key] = copy.deepcopy(chance.choice(ALL))
        case 3:
            other, name = chance.choice(spots)
            holder[key] = copy.deepcopy(other[name])
        case 4:
            _renew(holder, key, _word(chance, words), keep=False)
        case 5:
            _renew(holder, key, _word(chance, words), keep=True)
        case 6 if len(holder) > 1 or isinstance(holder, dict):
            del holder[key]
        case 7 if isinstance(value, int | float) and not isinstance(value, bool):
            holder[key] = value * chance.choice((-1, 0, 1e-6, 0.1, 3, 1e3, 1e9, 1e300))
        case 8:
            holder[key] = chance.choice(([value], {_word(chance, words): value}, [value, value], str(value)))
        case _ if isinstance(value, dict):
            value[_word(chance, words)] = copy.deepcopy(chance.choice(ALL))
        case _ if isinstance(value, list):
            value.append(copy.deepcopy(chance.choice((*value, *ALL))))
        case _:
            holder[key] = copy.deepcopy(chance.choice(ALL))


def _renew(holder: Holder, key: Any, name: object, *, keep: bool) -> None:
    """Rename a value's key, or add a copy under another."""
    value = copy.deepcopy(holder[key])
    if isinstance(holder, list):
        holder.append(value)
        return
    if not keep:
        del holder[key]
    holder[name] = value


def _word(chance: random.Random, words: Sequence[str]) -> Any:
    """Return a key: mostly a known one, at times a misspelt or an absurd one."""
    word = chance.choice(words)
    match chance.randint(0, 5):
        case 0:
            at = chance.randrange(len(word) + 1)
            return word[:at] + chance.choice("x_ 1é") + word[at:]
        case 1:
            return chance.choice([value for value in ALL if not isinstance(value, list | dict)])
    return word
