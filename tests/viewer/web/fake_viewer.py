"""Browser for tests that draws nothing: it connects to a page, and keeps its nodes and their poses."""

from __future__ import annotations

import threading
from typing import Any

import msgspec
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Subprotocol

from tests.support.waiting import TIMEOUT

CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 1.0, 1.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 100,
    "image_width": 100,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


class FakeViewer:
    """Viewer of a page.

    Args:
        url: address of the page.
    """

    def __init__(self, url: str) -> None:
        protocol = Subprotocol(f"viser-v{viser.__version__}")
        address = url.replace("http://", "ws://")
        self._line = connect(address, subprotocols=[protocol], max_size=None, open_timeout=TIMEOUT)
        self.nodes: dict[str, dict[str, Any]] = {}
        """Properties of the current nodes."""
        self.texts: list[str] = []
        """Markdown on the panel, and notifications, in order."""
        self.moves = 0
        """Count of pose changes."""
        self.send(CAMERA)
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def send(self, message: Any) -> None:
        """Send a message."""
        self._line.send(message if isinstance(message, bytes) else msgspec.msgpack.encode(message))

    def hide(self, *, is_hidden: bool) -> None:
        """Hide or show its tab."""
        self.send({"type": "TabVisibilityMessage", "hidden": is_hidden})

    def sees(self, *names: str) -> bool:
        """Return whether there are nodes of these names."""
        return all(f"/scene/{name}" in self.nodes for name in names)

    def position(self, name: str) -> list[float]:
        """Last position of a node [m]."""
        return list(self.nodes[f"/scene/{name}"]["position"])

    def close(self) -> None:
        """Disconnect."""
        self._line.close()
        self._thread.join(TIMEOUT)

    def _listen(self) -> None:
        try:
            while True:
                data = self._line.recv()
                assert isinstance(data, bytes)
                size = int.from_bytes(data[8:16], "little")
                text = zstandard.ZstdDecompressor().decompress(data[16 : 16 + size])
                for message in msgspec.msgpack.decode(text)["messages"]:
                    self._take(message)
        except ConnectionClosed:
            return

    def _take(self, message: dict[str, Any]) -> None:
        name = message.get("name")
        match message["type"]:
            case "RemoveSceneNodeMessage":
                gone = [each for each in self.nodes if each == name or each.startswith(f"{name}/")]
                for each in gone:
                    del self.nodes[each]
            case "SetPositionMessage" if name in self.nodes:
                self.nodes[name]["position"] = message["position"]
                self.moves += 1
            case "GuiMarkdownMessage" | "NotificationMessage" | "NotificationShowMessage":
                self.texts.append(str(message))
            case "GuiUpdateMessage" if "_markdown" in message["updates"]:  # also of a new element
                self.texts.append(str(message))
            case _ if isinstance(name, str) and "props" in message:
                self.nodes[name] = {"position": (0.0, 0.0, 0.0)}
