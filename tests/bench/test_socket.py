"""What a socket costs, with few messages."""

import pytest

from cellwright.bench import socket


def test_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "lockstep", lambda _until: iter(()))  # it is a run of the command, tested with that
    told: list[str] = []
    figures = {figure.what: figure for figure in socket.measure(told.append, quick=True)}
    assert len(told) == 4
    for what in ("a service call", "a command, until it is answered", "a goal, until its status comes"):
        assert figures[what].value > 0.0
    lost = [figure for what, figure in figures.items() if what.endswith("lost")]
    assert [(figure.value, figure.most) for figure in lost] == [(0, 0.0)] * 2
    assert 0.0 < figures["real time, with a listener"].value < 1.5
