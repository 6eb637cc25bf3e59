import os

import pytest

from cellwright.running.evaluation.execution.process import usable_processors


def test_usable_processors_follow_affinity(monkeypatch: pytest.MonkeyPatch) -> None:
    assert 1 <= usable_processors() <= (os.cpu_count() or 1)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _process: {0, 3, 5}, raising=False)
    assert usable_processors() == 3


@pytest.mark.parametrize(("cpu_count", "expected"), [(4, 4), (None, 1)])
def test_usable_processors_without_affinity_are_cpu_count(
    cpu_count: int | None, expected: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "sched_getaffinity", raising=False)
    monkeypatch.setattr(os, "cpu_count", lambda: cpu_count)
    assert usable_processors() == expected
