"""Visibility of a browser's tab: a hidden tab gets nothing, until it is shown again.

viser's client does not report it. So the page's HTML begins with a script that does, over viser's own connection.
"""

import gzip

import msgspec
from websockets.http11 import Response

from cellwright.viewer.web.input import SCRIPT

_TAG = "TabVisibilityMessage"
_SCRIPT = f"""<script>(() => {{
  const connected = new Set();
  const report = worker =>
    worker.postMessage({{type: "send", message: {{type: "{_TAG}", hidden: document.hidden}}}});
  window.Worker = class extends window.Worker {{
    constructor(...options) {{
      super(...options);
      this.addEventListener("message", event => {{
        if (event.data.type === "connected") {{ connected.add(this); report(this); }}
      }});
    }}
  }};
  document.addEventListener("visibilitychange", () => connected.forEach(report));
}})();</script>""".encode()
_PLACE = b"<head>"


class _Visibility(msgspec.Struct, tag_field="type", tag=_TAG, forbid_unknown_fields=True):
    """Message of the script."""

    hidden: bool


_decoder = msgspec.msgpack.Decoder(_Visibility)


def read_visibility(data: bytes | str) -> bool | None:
    """Return whether the tab that sent a message is shown; None if the message says something else.

    Example:
        >>> read_visibility(msgspec.msgpack.encode({"type": "TabVisibilityMessage", "hidden": True}))
        False
    """
    if not isinstance(data, bytes) or _TAG.encode() not in data:
        return None
    try:
        return not _decoder.decode(data).hidden
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None


class ReportingPage:
    """HTML of the page with this script in it, and that of keys and gamepad; it is changed once."""

    def __init__(self) -> None:
        self._bodies: dict[bytes, bytes] = {}

    def add_script(self, response: Response) -> None:
        """Put the script into a response, if that is HTML."""
        if not response.headers.get("Content-Type", "").startswith("text/html"):
            return
        is_packed = response.headers.get("Content-Encoding") == "gzip"
        before = bytes(response.body)
        body = self._bodies.get(before)
        if body is None:
            text = gzip.decompress(before) if is_packed else before
            text = text.replace(_PLACE, _PLACE + _SCRIPT + SCRIPT, 1)
            body = self._bodies[before] = gzip.compress(text) if is_packed else text
        response.body = body
        del response.headers["Content-Length"]
        response.headers["Content-Length"] = str(len(body))
