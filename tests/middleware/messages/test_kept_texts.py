"""Texts that are written once and looked up from then on."""

from __future__ import annotations

import pytest

from cellwright.middleware.messages import kept_texts
from cellwright.middleware.messages.kept_texts import KeptTexts, text, texts


def test_bytes_by_hand() -> None:
    assert text("") == b"\1\0\0\0\0"
    assert text("ä") == b"\3\0\0\0\xc3\xa4\0"
    assert texts(()) == b"\0\0\0\0"
    three = b"\3\0\0\0", b"\2\0\0\0a\0", b"\0\0", b"\4\0\0\0abc\0", b"\1\0\0\0\0"
    assert texts(("a", "abc", "")) == b"".join(three)


def test_zeros_follow_where_they_are_wanted() -> None:
    plain, filled = KeptTexts(text, filled=False), KeptTexts(text, filled=True)
    assert plain["ab"] == b"\3\0\0\0ab\0"
    assert filled["ab"] == b"\3\0\0\0ab\0\0"
    assert filled["abc"] == plain["abc"] == b"\4\0\0\0abc\0"


def test_what_was_written_is_kept() -> None:
    kept = KeptTexts(texts, filled=True)
    assert kept["a", "b"] is kept["a", "b"]
    assert kept["a", "b"] == texts(("a", "b")) + b"\0\0"


def test_what_is_kept_has_an_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kept_texts, "MOST", 10)
    kept = KeptTexts(text, filled=False)
    long = "x" * kept_texts.LONGEST
    assert kept[long] == text(long)
    assert not kept
    for number in range(100):
        assert kept[f"{number}"] == text(f"{number}")
        assert 1 <= len(kept) <= 10


def test_what_cannot_be_written_is_not_kept() -> None:
    kept = KeptTexts(text, filled=False)
    for value in (5, "\ud800"):
        with pytest.raises((AttributeError, UnicodeEncodeError)):
            kept[value]
    assert not kept
