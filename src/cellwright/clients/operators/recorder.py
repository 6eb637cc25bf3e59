"""Writes what a robot does, or what it is told, as a file of targets that can be played again."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

from cellwright.clients.operators.robot import JOINT_STATES, OperatedRobot
from cellwright.middleware.messages.build import nanoseconds
from cellwright.util.errors import CellwrightError, RunEndedError, UsageError
from cellwright.util.line_file import LineFile


class Recorder:
    """Writes a line for each joint state, as it comes.

    Args:
        robot: whose they are.
        path: a file that ends in .csv or .jsonl.
        topic: what is recorded: measured positions, or another topic of all joints.
        report: takes a line about a file that can be written no more.

    Raises:
        UsageError: the file cannot be written.
    """

    def __init__(
        self,
        robot: OperatedRobot,
        path: Path,
        *,
        topic: str = JOINT_STATES,
        report: Callable[[str], None] = lambda _line: None,
    ) -> None:
        self._session = robot.session
        self._joints = robot.joints
        self._is_csv = path.suffix.lower() == ".csv"
        try:
            self._file = LineFile(path, report=report)
        except OSError as error:
            raise UsageError(f"{path}: cannot be written: {error.strerror or error}") from None
        if self._is_csv:
            self._file.write(_line(["time", *self._joints]))
        self._begun: float | None = None
        self.lines = 0
        """How many moments were written."""
        self.time = 0.0
        """Of the newest, from the first on [s]."""
        try:
            self._leave = self._session.subscribe(topic, self._take)
        except BaseException:
            self._file.close()
            raise

    @property
    def is_writing(self) -> bool:
        """Whether moments still go to the file."""
        return self._file.is_writing

    def close(self) -> None:
        """Write no more."""
        with suppress(CellwrightError, RunEndedError):  # there may be nobody left to tell
            self._leave()
        self._file.close()

    def _take(self, message: Any) -> None:
        stamp = nanoseconds(message.header.stamp) / 1e9 or self._session.time
        if self._begun is None:
            self._begun = stamp
        time = max(self.time, stamp - self._begun)
        known = dict(zip(message.name, map(float, message.position), strict=False))
        values = {name: known[name] for name in self._joints if math.isfinite(known.get(name, math.nan))}
        if not values:
            return
        if self._is_csv:
            fields = (f"{values[name]:.9g}" if name in values else "" for name in self._joints)
            self._file.write(_line([f"{time:.6f}", *fields]))
        else:
            self._file.write(json.dumps({"time": round(time, 6), "positions": values}))
        self.lines += 1
        self.time = time


def _line(fields: list[str]) -> str:
    text = io.StringIO()
    csv.writer(text, lineterminator="").writerow(fields)
    return text.getvalue()
