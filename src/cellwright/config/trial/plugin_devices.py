"""The entry `devices` of Cellwright's own section: devices that other packages bring along, and their settings."""

from __future__ import annotations

from typing import Any

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Items, Leaf, Node, Table, shortened
from cellwright.config.trial.trial import PluginDevice
from cellwright.util.errors import did_you_mean
from cellwright.util.plugins import entry_points as plugins


def read_plugin_devices(node: Node | None, reader: Reader) -> tuple[PluginDevice, ...]:
    """What the section `cellwright` has under `devices`: `{name: {type, …}}`; what else is there is for the device."""
    devices = node.get("devices") if isinstance(node, Table) else None
    table = reader.table(devices) if devices else None
    known = plugins.names("devices") if table else []
    found = []
    for entry in table.entries.values() if table else ():
        name, body = reader.text_key(entry), reader.table(entry.value)
        type_node = reader.required(body, "type") if body else None
        device_type = reader.name(type_node) if type_node else None
        if name is None or body is None or type_node is None or device_type is None:
            continue
        if device_type not in known:
            suggestion = did_you_mean(device_type, known) or f" (known: {', '.join(known) or 'none'})"
            reader.problems.error(type_node, f"unknown device type {shortened(device_type)!r}{suggestion}")
        settings = {str(each.name): _plain(each.value) for each in body.entries.values() if each.name != "type"}
        found.append(PluginDevice(name, device_type, settings))
    return tuple(found)


def _plain(node: Node) -> Any:
    """A node as plain data: dicts, lists and scalars."""
    match node:
        case Table():
            return {str(entry.name): _plain(entry.value) for entry in node.entries.values()}
        case Items():
            return [_plain(item) for item in node.items]
        case Leaf():
            return node.value
