"""Inputs that are XML, changed as trees."""

from __future__ import annotations

import copy
import random
import xml.etree.ElementTree as ET
from collections.abc import Sequence

from fuzz.values import NUMBERS, TEXTS

_VALUES = (
    *map(repr, NUMBERS),
    *TEXTS,
    "0 0 0",
    "1 2",
    "1e308 1e308 1e308",
    "nan nan nan",
    "1,2,3",
    "-1 -1 -1",
    "fixed",
)
_MAX_ELEMENTS = 1000


def mutate(data: bytes, chance: random.Random, tags: Sequence[str], names: Sequence[str]) -> bytes | None:
    """Return the document with changes in it; None if it cannot be changed.

    Args:
        data: the document.
        chance: source of the changes.
        tags: the reader's kinds of elements.
        names: its attributes.
    """
    try:
        root = ET.fromstring(data)
    except (ET.ParseError, ValueError, RecursionError):
        return None
    for _ in range(chance.randint(1, 4)):
        every = list(root.iter())
        if len(every) > _MAX_ELEMENTS:
            break
        _change(root, every, chance, tags, names)
    changed: bytes = ET.tostring(root, encoding="utf-8")
    return changed


def _change(
    root: ET.Element, every: Sequence[ET.Element], chance: random.Random, tags: Sequence[str], names: Sequence[str]
) -> None:
    element = chance.choice(every)
    attribute = chance.choice([*element.attrib, chance.choice(names)])
    match chance.randint(0, 9):
        case 0 | 1 | 2:
            element.set(attribute, _printable(chance.choice(_VALUES)))
        case 3:
            other = chance.choice(every)
            element.set(attribute, chance.choice([*other.attrib.values(), ""]))
        case 4:
            element.attrib.pop(attribute, None)
        case 5:
            element.text = _printable(chance.choice(_VALUES))
        case 6:
            element.tag = chance.choice(tags)
        case 7 if len(element):
            element.remove(chance.choice(list(element)))
        case 8:
            twin = copy.deepcopy(chance.choice(every))
            if twin.tag != root.tag or sum(1 for _ in twin.iter()) < 20:
                element.append(twin)
        case _:
            child = ET.SubElement(element, chance.choice(tags))
            child.set(chance.choice(names), _printable(chance.choice(_VALUES)))


def _printable(text: str) -> str:
    """Return a text with the characters that XML allows."""
    return "".join(c for c in text if c.isprintable() or c in "\t\n")
