import pytest

from cellwright.bridges.ros1.loop import Loop
from cellwright.bridges.ros1.tally import Tally


def test_the_first_at_once_the_others_after_a_second(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cellwright.bridges.ros1.tally.PERIOD", 0.05)
    loop = Loop()
    tally = Tally(loop, "{count} of {subject}")
    for _ in range(5):
        tally.count("apples")
    tally.count("pears")
    loop.later(0.02, lambda: loop.stop(0))
    loop.run()
    assert capsys.readouterr().err == "1 of apples\n1 of pears\n"
    loop.later(0.2, lambda: loop.stop(0))
    loop.run()
    assert capsys.readouterr().err == "4 of apples\n"
    assert not tally._counts  # what has come to rest is forgotten
    loop.close()
