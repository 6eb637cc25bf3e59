"""Tests of recorded pictures of bags: the newest of each camera at each frame, in each encoding, and refusals."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from cellwright.recording.dataset.bagged import bag_episode
from cellwright.recording.dataset.lerobot import write_lerobot
from cellwright.recording.dataset.read import DataSet
from cellwright.util.errors import UsageError
from tests.recording.dataset.bags import COMMANDS, HEAD, STATES, Message, bag

SIZE = (64, 96, 3)
MOVES: list[Message] = [(STATES, 10.0 + k / 100, {"lift": k / 100}) for k in range(101)]
MOVES.append((COMMANDS, 10.0, {"lift": 1.0}))
WHITE, RED = np.full(SIZE, 255, np.uint8), np.zeros(SIZE, np.uint8)
RED[..., 0] = 255


def written(folder: Path, pictures: list[tuple[str, float, Any]], encoding: str = "rgb8") -> Path:
    return bag(folder, sorted([*MOVES, *pictures], key=lambda each: each[1]), encoding=encoding)


def level(number: int) -> Any:
    return np.full(SIZE, 20 * number, np.uint8)


def test_picture_of_a_frame_is_the_newest_at_its_begin(tmp_path: Path) -> None:
    # at 10 Hz, from 0.25 s on: two frames of 20 Hz each
    path = written(tmp_path, [(HEAD, 10.25 + k / 10, level(k)) for k in range(8)])
    episode = bag_episode(path, 20, ["head"], sentence="Lift it.")
    [film] = episode.films
    assert (film.camera, film.width, film.height) == ("head", 96, 64)
    write_lerobot(tmp_path / "set", [episode])
    shown = [float(each.mean()) for each in DataSet(tmp_path / "set").pictures(0, "observation.images.head")]
    assert len(shown) == 14  # from the first picture to the last one
    np.testing.assert_allclose(shown, [20 * (frame // 2) for frame in range(14)], atol=3)
    assert episode.columns[0].values[0, 0] == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("encoding", "pixels", "expected"),
    [
        ("rgb8", RED, (255, 0, 0)),
        ("bgr8", RED, (0, 0, 255)),
        ("rgba8", np.dstack([RED, WHITE[..., :1]]), (255, 0, 0)),
        ("bgra8", np.dstack([RED, WHITE[..., :1]]), (0, 0, 255)),
        ("mono8", RED[..., :1], (255, 255, 255)),
    ],
)
def test_encoding_is_turned_into_colours(encoding: str, pixels: Any, expected: Any, tmp_path: Path) -> None:
    path = written(tmp_path, [(HEAD, 10.0, pixels), (HEAD, 11.0, pixels)], encoding)
    [film] = bag_episode(path, 20, ["head"], sentence="Lift it.").films
    assert [each[0][0] for each in film.statistics.as_lists()["max"]] == [value / 255 for value in expected]


def test_compressed_picture_is_decoded(tmp_path: Path) -> None:
    content = io.BytesIO()
    Image.fromarray(WHITE).save(content, "JPEG")
    topic = f"{HEAD}/compressed"
    path = written(tmp_path, [(topic, 10.0, content.getvalue()), (topic, 11.0, content.getvalue())])
    [film] = bag_episode(path, 20, [topic], sentence="Lift it.").films
    assert (film.camera, film.frames) == ("io_teleop/camera_head/color/compressed", 20)
    assert film.statistics.as_lists()["mean"] == [[[1.0]]] * 3


@pytest.mark.parametrize(
    ("cameras", "pictures", "encoding", "text"),
    [
        (["wrist"], [(HEAD, 10.0, WHITE)], "rgb8", rf"camera wrist: no topic .* \(topics of pictures are: {HEAD}\)"),
        (["head"], [], "rgb8", r"camera head: no topic has pictures of it \(topics of pictures are: none\)"),
        (["color"], [(HEAD, 10.0, WHITE), ("/x/color", 10.0, WHITE)], "rgb8", r"camera color: several topics have"),
        (["head", HEAD], [(HEAD, 10.0, WHITE)], "rgb8", r"cameras: two name one topic \(got head, /io_teleop"),
        (["head"], [(HEAD, 10.0, WHITE), (HEAD, 11.0, WHITE)], "16UC1", r"encodings rgb8, .* \(got '16UC1'\)"),
        (
            ["head"],
            [(HEAD, 10.0, WHITE), (HEAD, 11.0, WHITE)],
            "rgba8",
            r"a picture lacks pixels \(got 18432 bytes for",
        ),
        (["head"], [(HEAD, 10.0, b"no"), (HEAD, 11.0, b"no")], "", r"cannot be decoded \(got 'jpeg'\); JPEG and PNG"),
    ],
    ids=["unknown", "none", "several", "twice", "depth", "short", "damaged"],
)
def test_camera_without_usable_pictures_is_refused(
    cameras: list[str], pictures: list[Message], encoding: str, text: str, tmp_path: Path
) -> None:
    with pytest.raises(UsageError, match=rf"session\.bag: .*{text}"):
        bag_episode(written(tmp_path, pictures, encoding), 20, cameras, sentence="Lift it.")
