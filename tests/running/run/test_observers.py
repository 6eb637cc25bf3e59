"""Tests of the pictures of a run."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest

from cellwright.rendering.views import gear2017_views
from cellwright.running.run import RunOptions, Session
from cellwright.running.run.observers import Pictures
from tests.support.cells import BARE


def test_picture_after_end_of_run_is_missed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    taken: list[Path] = []
    monkeypatch.setattr("cellwright.running.run.observers.save_png", lambda file, _: taken.append(file))
    monkeypatch.setattr(Pictures, "_draw", lambda *_: None)
    first, second, lines = tmp_path / "a.png", tmp_path / "b.png", list[str]()
    pictures = Pictures(
        gear2017_views()["overview"], [(Fraction(1, 20), first), (Fraction(1, 2), second)], lines.append
    )
    with Session(BARE, options=RunOptions(observers=[pictures])) as session:
        for _ in range(2):
            session.run(until=0.1)
            assert (pictures.written, pictures.missed) == ([str(first)], [str(second)]), "each run begins again"
    assert taken == [first, first]
    assert lines == [f"{second}: picture not taken; the run ended at 0.1 s, before 0.5 s"] * 2
