"""Tests of seals: a line is believed if it is unchanged and sealed with the same key."""

import json

import pytest

from cellwright.running.evaluation.results.seal import KEY_VARIABLE, SealError, sealed, unsealed

TEXT = '{"points":6.0}'


def test_sealed_line_is_json_with_the_seal_as_its_last_entry() -> None:
    line = sealed(TEXT)
    assert list(json.loads(line)) == ["points", "seal"]
    assert unsealed(line).decode() == TEXT


def test_changed_line_and_line_without_a_seal_are_refused() -> None:
    with pytest.raises(SealError, match=r"it was changed after it was written$"):
        unsealed(sealed(TEXT).replace(b"6.0", b"9.0"))
    with pytest.raises(SealError, match="it has no seal"):
        unsealed(TEXT.encode())


def test_line_of_another_key_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    line = sealed(TEXT)
    monkeypatch.setenv(KEY_VARIABLE, "secret")
    with pytest.raises(SealError, match=f"or sealed with another {KEY_VARIABLE}$"):
        unsealed(line)
    assert unsealed(sealed(TEXT)).decode() == TEXT
