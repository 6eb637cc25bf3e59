"""Python 2's dictionary order, number texts and division, as the 2017 launcher had them.

The original iterated over unordered dictionaries and numbered parts in that order. So which bin holds `gear_part_1`
follows from the table layout of CPython 2.7 (64 bit, hashes not randomised, as it always ran). This module reproduces
that layout for the kinds of keys that a configuration has.
"""

import math
from collections.abc import Iterable
from typing import TypeVar

T = TypeVar("T")

_MASK = (1 << 64) - 1
_MIN_TABLE_SIZE = 8


def dictionary_order(keys: Iterable[T]) -> list[T]:
    """Return keys in the iteration order of a CPython 2.7 dictionary into which they were inserted one by one."""
    slots: list[tuple[int, T] | None] = [None] * _MIN_TABLE_SIZE
    for used, key in enumerate(dict.fromkeys(keys), start=1):
        _put(slots, _hash(key), key)
        if used * 3 >= len(slots) * 2:
            slots = _resized(slots, used * (2 if used > 50000 else 4))
    return [slot[1] for slot in slots if slot is not None]


def number_text(value: float) -> str:
    """Format a number as `str` did: floats with 12 significant digits and always with a point, whole numbers plain."""
    if isinstance(value, int):
        return str(value)
    text = f"{value:.12g}"
    return text if any(c in text for c in ".en") else text + ".0"


def scalar_text(value: object) -> str:
    """Format any scalar as `str` did."""
    return number_text(value) if isinstance(value, float) else str(value)


def quotient(a: float, b: float) -> float:
    """Return `a / b`, rounded down if both are whole numbers."""
    return a // b if isinstance(a, int) and isinstance(b, int) else a / b


def _resized(old: list[tuple[int, T] | None], min_size: int) -> list[tuple[int, T] | None]:
    size = _MIN_TABLE_SIZE
    while size <= min_size:
        size *= 2
    slots: list[tuple[int, T] | None] = [None] * size
    for slot in old:
        if slot is not None:
            _put(slots, *slot)
    return slots


def _put(slots: list[tuple[int, T] | None], hashed: int, key: T) -> None:
    """Insert by open addressing: the low bits first, then a probe sequence that mixes in all bits of the hash."""
    mask = len(slots) - 1
    index, perturb = hashed & mask, hashed
    while slots[index & mask] is not None:
        index = index * 5 + perturb + 1
        perturb >>= 5
    slots[index & mask] = (hashed, key)


def _hash(key: object) -> int:
    if isinstance(key, str):
        hashed = _text_hash(key)
    elif isinstance(key, int):
        hashed = key if abs(key) < 1 << 63 else hash(key)
    elif isinstance(key, float) and math.isfinite(key):
        hashed = _float_hash(key)
    else:  # an address, or a kind of key that no section accepts: any fixed value works
        hashed = 0
    return (-2 if hashed == -1 else hashed) & _MASK


def _text_hash(text: str) -> int:
    if not text:
        return 0
    hashed = ord(text[0]) << 7
    for character in text:
        hashed = (1000003 * hashed ^ ord(character)) & _MASK
    hashed ^= len(text)
    return -1 if hashed == _MASK else hashed


def _float_hash(value: float) -> int:
    if value == math.floor(value):
        return _hash(int(value))
    fraction, exponent = math.frexp(value)
    fraction *= 2147483648.0
    high = int(fraction)
    low = (fraction - high) * 2147483648.0
    return high + int(low) + (exponent << 15)
