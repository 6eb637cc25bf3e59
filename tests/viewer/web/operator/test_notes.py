"""Notes for the operator."""

from cellwright.viewer.web.operator.command_queue import NOTE_DURATION, NOTE_GAP, Notes


def test_note_is_shown_for_its_duration() -> None:
    notes = Notes()
    assert notes.at(0.0) == ""
    notes.add("home: done", 10.0)
    assert notes.at(10.0 + NOTE_DURATION / 2) == "home: done"
    assert notes.at(10.0 + NOTE_DURATION) == ""


def test_note_kind_is_shown_once_per_second() -> None:
    notes = Notes()
    notes.add("refused: a", 0.0, kind="refused", is_bad=True)
    notes.add("refused: b", NOTE_GAP / 2, kind="refused", is_bad=True)
    assert notes.at(NOTE_GAP / 2) == "refused: a"
    notes.add("done", NOTE_GAP / 2)
    assert (notes.at(NOTE_GAP / 2), notes.is_bad) == ("done", False), "another kind is shown at once"
    notes.add("refused: c", NOTE_GAP, kind="refused", is_bad=True)
    assert notes.at(NOTE_GAP) == "refused: c"
