"""Keys and gamepad of a browser: viser reports neither, so a script in the page's HTML does, twenty times a second.

It works on a page with the mark of the operator alone: elsewhere viser moves its camera by the same keys. It sends
while a key of its list or an axis is held, and once when all are let go. While someone types into a field, and while
the tab is hidden, it sends nothing. So a lost browser moves nothing: a velocity soon ends.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from cellwright.util.pose import Vector3

JOG_SPEED, JOG_TURN = 0.25, 0.6
"""Speed of the tool [m/s, rad/s] with a held key, or with an axis at its end."""
FAST = 3.0
"""Factor with the shift key."""
DEAD_ZONE = 0.15
"""Deflection of an axis that counts as none."""

MARK = '<span id="cellwright-operator"></span>'
"""Mark on a page whose keys move an arm."""

_TAG = "OperatorInputMessage"
_MAX_PRESSED = 8
SCRIPT = f"""<script>(() => {{
  const axes = {{KeyW: [0, 1], KeyS: [0, -1], KeyA: [1, 1], KeyD: [1, -1], KeyR: [2, 1], KeyF: [2, -1],
    KeyQ: [5, 1], KeyE: [5, -1]}};
  const presses = {{Space: "stop", KeyC: "clear", KeyG: "grip", KeyV: "release", KeyH: "home", KeyX: "snap"}};
  const buttons = ["grip", "release", "snap", "home", null, null, null, null, "clear", "stop"];
  const connected = new Set(), held = new Set();
  let fast = false, quiet = true;
  window.Worker = class extends window.Worker {{
    constructor(...options) {{
      super(...options);
      this.addEventListener("message", event => {{ if (event.data.type === "connected") connected.add(this); }});
    }}
  }};
  const works = () => document.getElementById("cellwright-operator") !== null;
  const typing = event => event.target instanceof HTMLElement &&
    (event.target.isContentEditable || ["INPUT", "TEXTAREA", "SELECT"].includes(event.target.tagName));
  window.addEventListener("keydown", event => {{
    if (!works() || typing(event) || event.ctrlKey || event.altKey || event.metaKey) return;
    fast = event.shiftKey;
    if (!(event.code in axes || event.code in presses)) return;
    held.add(event.code);
    event.preventDefault();
    event.stopImmediatePropagation();
  }}, true);
  window.addEventListener("keyup", event => {{ held.delete(event.code); fast = event.shiftKey; }}, true);
  window.addEventListener("blur", () => held.clear());
  setInterval(() => {{
    if (document.hidden || !works()) {{ held.clear(); if (quiet) return; }}
    const values = [0, 0, 0, 0, 0, 0], pressed = [];
    for (const code of held) {{
      if (code in axes) values[axes[code][0]] += axes[code][1];
      else pressed.push(presses[code]);
    }}
    const pad = navigator.getGamepads ? [...navigator.getGamepads()].find(each => each && each.connected) : null;
    if (pad && !document.hidden && works()) {{
      const [x = 0, y = 0, turn = 0, up = 0] = pad.axes;
      [[0, -y], [1, -x], [2, -up], [5, -turn]].forEach(([index, value]) => {{
        if (Math.abs(value) > {DEAD_ZONE}) values[index] += value;
      }});
      pad.buttons.forEach((button, index) => {{ if (button.pressed && buttons[index]) pressed.push(buttons[index]); }});
    }}
    const none = values.every(value => value === 0) && pressed.length === 0;
    if (none && quiet) return;
    quiet = none;
    const message = {{type: "{_TAG}", values, pressed: pressed.slice(0, {_MAX_PRESSED}), fast}};
    connected.forEach(worker => worker.postMessage({{type: "send", message}}));
  }}, 50);
}})();</script>""".encode()

KEYS_HTML = (
    '<div style="padding:0.15em 0.75em;font-size:0.8em;opacity:0.8">Keys: W S along x, A D along y, R F up and down, '
    "Q E turn, with Shift faster; G grip, V release, X snap, H home, Space STOP, C clear. A gamepad's left stick moves "
    "along the floor, its right one up, down and around.</div>"
)

_Share = Annotated[float, msgspec.Meta(ge=-4.0, le=4.0)]
_Word = Annotated[str, msgspec.Meta(max_length=10)]
COMMANDS = frozenset({"stop", "clear", "grip", "release", "home", "snap"})
"""Commands of keys and buttons."""


class Input(msgspec.Struct, tag_field="type", tag=_TAG, forbid_unknown_fields=True):
    """Message of the script: shares of the six velocities, along and about x, y and z, and what is pressed."""

    values: tuple[_Share, _Share, _Share, _Share, _Share, _Share]
    pressed: Annotated[list[_Word], msgspec.Meta(max_length=_MAX_PRESSED)]
    fast: bool


_decoder = msgspec.msgpack.Decoder(Input)


def read_input(data: bytes | str) -> Input | None:
    """Return what the keys and the gamepad of a browser say; None if the message says something else.

    Example:
        >>> message = {"type": "OperatorInputMessage", "values": [1, 0, 0, 0, 0, 0], "pressed": [], "fast": False}
        >>> read_input(msgspec.msgpack.encode(message)).values[0]
        1.0
    """
    if not isinstance(data, bytes) or _TAG.encode() not in data:
        return None
    try:
        found = _decoder.decode(data)
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
        return None
    is_known = all(map(math.isfinite, found.values)) and COMMANDS.issuperset(found.pressed)
    return found if is_known else None


def jog(given: Input) -> tuple[Vector3, Vector3]:
    """Return the velocity of the tool that keys and gamepad ask for [m/s, rad/s]."""
    factor = FAST if given.fast else 1.0
    x, y, z, a, b, c = (max(-1.0, min(1.0, each)) * factor for each in given.values)
    return (JOG_SPEED * x, JOG_SPEED * y, JOG_SPEED * z), (JOG_TURN * a, JOG_TURN * b, JOG_TURN * c)
