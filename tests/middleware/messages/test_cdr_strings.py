"""Cache of encoded strings."""

from __future__ import annotations

import pytest

from cellwright.middleware.messages import cdr
from cellwright.middleware.messages.cdr import StringCache, cdr_string, cdr_strings


def test_cdr_strings_match_hand_written_bytes() -> None:
    assert cdr_string("") == b"\1\0\0\0\0"
    assert cdr_string("ä") == b"\3\0\0\0\xc3\xa4\0"
    assert cdr_strings(()) == b"\0\0\0\0"
    three = b"\3\0\0\0", b"\2\0\0\0a\0", b"\0\0", b"\4\0\0\0abc\0", b"\1\0\0\0\0"
    assert cdr_strings(("a", "abc", "")) == b"".join(three)


def test_string_cache_with_filling_pads_with_zeros() -> None:
    plain, filled = StringCache(cdr_string, filled=False), StringCache(cdr_string, filled=True)
    assert plain["ab"] == b"\3\0\0\0ab\0"
    assert filled["ab"] == b"\3\0\0\0ab\0\0"
    assert filled["abc"] == plain["abc"] == b"\4\0\0\0abc\0"


def test_string_cache_returns_same_bytes_again() -> None:
    kept = StringCache(cdr_strings, filled=True)
    assert kept["a", "b"] is kept["a", "b"]
    assert kept["a", "b"] == cdr_strings(("a", "b")) + b"\0\0"


def test_string_cache_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cdr, "MAX_CACHED_STRINGS", 10)
    kept = StringCache(cdr_string, filled=False)
    long = "x" * cdr.MAX_CACHED_BYTES
    assert kept[long] == cdr_string(long)
    assert not kept
    for number in range(100):
        assert kept[f"{number}"] == cdr_string(f"{number}")
        assert 1 <= len(kept) <= 10


def test_string_cache_does_not_keep_invalid_strings() -> None:
    kept = StringCache(cdr_string, filled=False)
    for value in (5, "\ud800"):
        with pytest.raises((AttributeError, UnicodeEncodeError)):
            kept[value]
    assert not kept
