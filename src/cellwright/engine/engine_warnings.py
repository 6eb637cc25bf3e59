"""What the engine complains of: logged, instead of written to a file in the working directory."""

from __future__ import annotations

import logging

import mujoco

_log = logging.getLogger("cellwright.engine")

unstable: list[str] = []
"""Complaints that a state has become no number or huge: whatever follows in that run is worthless."""


def _take(text: str) -> None:
    _log.warning(text)
    if "unstable" in text:
        unstable.append(text)


mujoco.set_mju_user_warning(_take)
