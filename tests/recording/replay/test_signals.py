"""Signals of a recording: names, and periods in which they hold."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import Bool, String
from cellwright.recording.format import format as names
from cellwright.recording.format.format import RecordedTopic, RecordingHeader
from cellwright.recording.format.mcap_file import McapFile
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.signals import Signals
from cellwright.util.errors import UnknownNameError

SECOND = 1_000_000_000


def test_texts_and_booleans_are_signals_until_they_change(tmp_path: Path) -> None:
    state, light = RecordedTopic("/ariac/agv1/state", "std_msgs/String"), RecordedTopic("/lamp_on", "std_msgs/Bool")
    words = ["ready_to_deliver", "delivering", "delivering", "x" * 61]
    with McapFile(tmp_path / "a.mcap") as file:
        file.describe(names.METADATA, RecordingHeader("cell", "small").metadata())
        state_channel, light_channel = file.channel(state), file.channel(light)
        for number, word in enumerate(words):
            file.add(state_channel, number * SECOND, TYPES.to_cdr(String(data=word)))
            file.add(light_channel, number * SECOND, TYPES.to_cdr(Bool(data=number == 1)))
    with RecordingFile(tmp_path / "a.mcap") as recording:
        signals = Signals(recording)
        assert signals.names() == ("agv1 delivering", "agv1 ready to deliver", "lamp on")
        (span,) = signals.spans("agv1 delivering")
        assert (span.begin, span.end) == (1.0, 3.0), "a long text is a description, and no signal"
        assert [(each.begin, each.end) for each in signals.spans("lamp_on")] == [(1.0, 2.0)]
        with pytest.raises(UnknownNameError, match="unknown signal 'agv1 deliverin'; did you mean agv1 delivering"):
            signals.spans("agv1 deliverin")
