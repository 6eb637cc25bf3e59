"""Lines for whoever drives."""

from cellwright.viewer.web.operator.notes import GAP, LASTS, Notes


def test_a_line_stands_for_a_while() -> None:
    notes = Notes()
    assert notes.at(0.0) == ""
    notes.tell("home: done", 10.0)
    assert notes.at(10.0 + LASTS / 2) == "home: done"
    assert notes.at(10.0 + LASTS) == ""


def test_of_a_kind_one_a_second_is_told() -> None:
    notes = Notes()
    notes.tell("refused: a", 0.0, kind="refused", is_bad=True)
    notes.tell("refused: b", GAP / 2, kind="refused", is_bad=True)
    assert notes.at(GAP / 2) == "refused: a"
    notes.tell("done", GAP / 2)
    assert (notes.at(GAP / 2), notes.is_bad) == ("done", False), "another kind is told at once"
    notes.tell("refused: c", GAP, kind="refused", is_bad=True)
    assert notes.at(GAP) == "refused: c"
