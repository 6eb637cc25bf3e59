"""What comes in on the `io_teleop` topics, made into targets."""

from __future__ import annotations

import math
from typing import Any

from cellwright.bus import Bus
from cellwright.contracts.table import Row
from cellwright.errors import RejectedCommandError
from cellwright.teleop.commander import Commander
from cellwright.teleop.counts import Counts


class Commands:
    """Hears the topics of commands, and answers the services."""

    def __init__(self, commander: Commander, counts: Counts) -> None:
        self._commander = commander
        self._counts = counts

    def serve(self, bus: Bus, table: tuple[Row, ...]) -> None:
        """Take a place on the bus."""
        rows = {row.name: row for row in table}
        for name in ("/io_teleop/joint_cmd", "/io_teleop/target_joint_from_vr"):
            bus.listen(name, rows[name].type, self._joint_command, node=rows[name].node)

    def _joint_command(self, message: Any, _node: str) -> None:
        names, positions = list(message.name), message.position.tolist()
        if len(names) != len(positions) or not all(map(math.isfinite, positions)):
            raise RejectedCommandError("as many finite positions as names are needed")
        known = [
            (self._commander.numbers[name], value)
            for name, value in zip(names, positions, strict=True)
            if name in self._commander.numbers
        ]
        self._commander.aim([number for number, _ in known], [value for _, value in known])
        self._counts.taken += 1
