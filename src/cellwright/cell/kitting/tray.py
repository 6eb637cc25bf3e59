"""What lies on the trays, as last reported."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose


@dataclass(frozen=True, slots=True)
class TrayObject:
    """Something that touches a tray's plate or is locked to it.

    Attributes:
        name: full model name.
        type: type of the part, as kits name it.
        is_faulty: whether it is one of the trial's faulty parts; such a part earns nothing.
        tray_T_object: where it is, in the tray's frame.
    """

    name: str
    type: str
    is_faulty: bool
    tray_T_object: Pose


TrayContents: TypeAlias = tuple[TrayObject, ...]
"""The objects on one tray in the order in which they were reported; the scorer matches them in that order."""


class Trays:
    """The last report of each tray; a tray is known from its first report on."""

    def __init__(self) -> None:
        self._contents: dict[str, TrayContents] = {}

    def report(self, tray_id: str, contents: Iterable[TrayObject]) -> None:
        """Take note of what is on a tray now."""
        self._contents[tray_id] = tuple(contents)

    def contents(self, tray_id: str) -> TrayContents:
        """What was last reported of a tray.

        Raises:
            UnknownNameError: no tray of that name has reported.
        """
        try:
            return self._contents[tray_id]
        except KeyError:
            raise UnknownNameError("tray", tray_id, self._contents) from None

    def all_contents(self) -> tuple[TrayContents, ...]:
        """What was last reported, tray by tray."""
        return tuple(self._contents.values())

    def get_state(self) -> dict[str, Any]:
        """The reports as JSON values."""
        return {tray_id: contents_to_json(contents) for tray_id, contents in self._contents.items()}

    def set_state(self, state: Mapping[str, Any]) -> None:
        """Take over what `get_state` returned."""
        self._contents = {tray_id: contents_from_json(contents) for tray_id, contents in state.items()}


def contents_to_json(contents: TrayContents) -> list[dict[str, Any]]:
    """A tray's contents as JSON values; positions [m], quaternions (w, x, y, z)."""
    return [
        {
            "name": each.name,
            "type": each.type,
            "is_faulty": each.is_faulty,
            "position": list(each.tray_T_object.position),
            "quaternion": list(each.tray_T_object.quaternion),
        }
        for each in contents
    ]


def contents_from_json(values: Iterable[Mapping[str, Any]]) -> TrayContents:
    """A tray's contents from what `contents_to_json` returned."""
    return tuple(
        TrayObject(
            each["name"], each["type"], each["is_faulty"], Pose(tuple(each["position"]), tuple(each["quaternion"]))
        )
        for each in values
    )
