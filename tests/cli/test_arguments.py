"""Tests of the groups of options that commands share, and of their refusals."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cli.arguments import NetworkArguments, PageAddress, PageArguments, VideoArguments, record_options
from cellwright.middleware.ros2.host.ros2 import Ros2Options
from cellwright.running.run import PageOptions
from cellwright.util.errors import UsageError
from cellwright.viewer.web.start import DEFAULT_PORT


def requested(host: str | None = None, port: int | None = None) -> PageOptions:
    return PageAddress(host, port).options()


def test_page_options_without_view_are_none() -> None:
    assert PageArguments().options() is None


@pytest.mark.parametrize("host", [None, "127.0.0.1", "127.0.0.2", "::1", "localhost"])
def test_loopback_page_has_no_token(host: str | None) -> None:
    assert requested(host).token == ""
    assert requested(host).port == DEFAULT_PORT


@pytest.mark.parametrize("host", ["0.0.0.0", "::", "192.168.1.5", "lab-pc"])
def test_network_pages_have_different_tokens(host: str) -> None:
    first, second = requested(host).token, requested(host).token
    assert len(first) >= 20
    assert first != second


@pytest.mark.parametrize("port", [-1, 65536])
def test_invalid_port_is_refused(port: int) -> None:
    with pytest.raises(UsageError, match="--view-port"):
        requested(port=port)


@pytest.mark.parametrize(
    ("video", "message"),
    [
        (VideoArguments(video_speed=2.0), "require --video FILE.mp4"),
        (VideoArguments(Path("run.mp4"), video_size="wide"), "--video-size wide: give width and height in pixels"),
        (VideoArguments(Path("run.avi")), "--video run.avi: give a file whose name ends in .mp4"),
    ],
)
def test_invalid_video_is_refused(video: VideoArguments, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        video.options(None)


def test_node_in_ros2_is_on_request_only() -> None:
    assert NetworkArguments().options(lockstep=False).ros2 is False
    asked = NetworkArguments(ros2=True, ros2_range="subnet").options(lockstep=True)
    assert (asked.lockstep, asked.ros2) == (True, Ros2Options("subnet"))
    with pytest.raises(UsageError, match="--ros2-names requires --ros2"):
        NetworkArguments(ros2_names="2017").options(lockstep=False)
    with pytest.raises(UsageError, match="--ros2-range moon: give localhost or subnet"):
        NetworkArguments(ros2=True, ros2_range="moon").options(lockstep=False)


def test_recording_of_unknown_kind_is_refused() -> None:
    assert record_options(None, None).paths == ()
    with pytest.raises(UsageError, match=r"--record run\.txt: give a file such as run\.mcap"):
        record_options([Path("run.txt")], None)
