"""Messages through the pipes of a render process: whole, or none."""

import io

import numpy as np
import pytest

from cellwright.rendering.worker import wire


def test_messages_arrive_in_order_and_none_follows() -> None:
    pipe = io.BytesIO()
    picture = np.arange(24, dtype=np.uint8).reshape(2, 4, 3)
    wire.write(pipe, (1, "scene", ("a",)))
    wire.write(pipe, picture)
    pipe.seek(0)
    assert wire.read(pipe) == (1, "scene", ("a",))
    assert np.array_equal(wire.read(pipe), picture)
    assert wire.read(pipe) is None


@pytest.mark.parametrize("kept", [0, 1, 10])
def test_message_cut_off_is_none(kept: int) -> None:
    pipe = io.BytesIO()
    wire.write(pipe, {"digest": "a" * 100})
    assert wire.read(io.BytesIO(pipe.getvalue()[:kept])) is None


def test_command_names_its_program_and_backends_in_order() -> None:
    assert wire.command(("egl", "rays"))[-2:] == ["egl", "rays"]
    assert "cellwright.rendering.worker.program" in " ".join(wire.command())
