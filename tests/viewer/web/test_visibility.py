"""Visibility of tabs: the script in the page's HTML, and its messages."""

import gzip
from typing import Any

import msgspec
import pytest
from websockets.datastructures import Headers
from websockets.http11 import Response

from cellwright.viewer.web.visibility import ReportingPage, read_visibility

HTML = b"<!doctype html><html><head><title>a</title></head></html>"


def message(**fields: Any) -> bytes:
    return msgspec.msgpack.encode({"type": "TabVisibilityMessage", **fields})


@pytest.mark.parametrize("hidden", [True, False])
def test_message_of_script_is_read(hidden: bool) -> None:
    assert read_visibility(message(hidden=hidden)) is not hidden


@pytest.mark.parametrize(
    "data",
    [
        message(),
        message(hidden=1),
        message(hidden=True, more=1),
        message(hidden=True)[:-1],
        msgspec.msgpack.encode({"type": "ViewerCameraMessage", "hidden": True}),
        b"",
        "TabVisibilityMessage",
    ],
)
def test_other_messages_say_nothing_of_visibility(data: bytes | str) -> None:
    assert read_visibility(data) is None


@pytest.mark.parametrize("is_packed", [True, False])
def test_html_begins_with_script_before_all_others(is_packed: bool) -> None:
    page = ReportingPage()
    bodies = []
    content = gzip.compress(HTML) if is_packed else HTML
    for _ in range(2):
        headers = Headers({"Content-Type": "text/html; charset=utf-8", "Content-Length": str(len(content))})
        headers["Content-Encoding"] = "gzip" if is_packed else "identity"
        response = Response(200, "OK", headers, content)
        page.add_script(response)
        assert response.headers.get_all("Content-Length") == [str(len(response.body))]
        bodies.append(response.body)
    assert bodies[0] is bodies[1], "it is changed once"
    text = gzip.decompress(bodies[0]) if is_packed else bodies[0]
    assert text.startswith(b"<!doctype html><html><head><script>")
    assert text.endswith(b"</script><title>a</title></head></html>")


def test_other_answers_stay_as_they_are() -> None:
    response = Response(200, "OK", Headers({"Content-Type": "image/png", "Content-Length": "6"}), b"<head>")
    ReportingPage().add_script(response)
    assert response.body == b"<head>"
    assert response.headers["Content-Length"] == "6"
