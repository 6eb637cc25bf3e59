"""Names of the bundled tasks as environments: `PickFromBin-v0` and so on."""

from __future__ import annotations

from typing import Final

import gymnasium

from cellwright.config.trial.catalogue import bundled_tasks

VERSION: Final = 0
"""Version in the names: a change of the physics, of a success or of a space raises it."""


def environment_id(task: str) -> str:
    """Return the name of a bundled task's environment.

    Example:
        >>> environment_id("pick_from_bin")
        'PickFromBin-v0'
    """
    return f"{''.join(word.capitalize() for word in task.split('_'))}-v{VERSION}"


def register_tasks() -> None:
    """Register the bundled tasks with Gymnasium, each under its name."""
    for task in bundled_tasks():
        gymnasium.register(
            environment_id(task),
            entry_point="cellwright.envs.cell_env:CellEnv",
            vector_entry_point="cellwright.envs.vector:CellVectorEnv",
            kwargs={"trial": task},
        )
