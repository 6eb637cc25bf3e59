"""Arithmetic in files: any text gives a finite number or a refusal, soon."""

from __future__ import annotations

import math
from collections.abc import Iterator

from cellwright.config.parsing.expressions import evaluate
from cellwright.util.errors import ExpressionError
from fuzz.values import TEXTS
from fuzz.verdict import FindingError

MAX_SIZE = 220
WORDS = (*(name for name in vars(math) if not name.startswith("_")), "**", "//", "1e308", "0x", "1j", "lambda:", "__")


def seeds() -> Iterator[bytes]:
    """Yield expressions as files have them, and some that they should not have."""
    for text in ("-pi/1.5", "radians(30)", "2**3**2", "comb(1000,500)", "gcd(4,6)", "ldexp(1,9)", "1/2", *TEXTS):
        yield text.encode("utf-8", "replace")


def attempt(data: bytes) -> None:
    """Evaluate as both Pythons would."""
    text = data.decode("utf-8", "surrogateescape")
    for whole_division in (False, True):
        try:
            value = evaluate(text, whole_division=whole_division)
        except ExpressionError as error:
            if len(str(error)) > 1500:
                raise FindingError(f"a message of {len(str(error))} characters") from None
            continue
        if not isinstance(value, float) or not math.isfinite(value):
            raise FindingError(f"{text!r} is {value!r}")
