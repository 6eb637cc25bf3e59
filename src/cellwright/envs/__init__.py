"""Environments for learning: cells with a task, under the interface of Gymnasium.

Importing this package registers the bundled tasks: `gymnasium.make("cellwright.envs:PickFromBin-v0")`. Without
Gymnasium, the extra `gym`, there is the stepper alone.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cellwright.envs.cell_env import CellEnv as CellEnv
    from cellwright.envs.served.server import EnvServer as EnvServer
    from cellwright.envs.served.session import EnvSession as EnvSession
    from cellwright.envs.stepper import CellStepper as CellStepper
    from cellwright.envs.vector import CellVectorEnv as CellVectorEnv

_HOMES = {
    "CellEnv": "cell_env",
    "CellStepper": "stepper",
    "CellVectorEnv": "vector",
    "EnvServer": "served.server",
    "EnvSession": "served.session",
}
_HAS_GYM = find_spec("gymnasium") is not None

if _HAS_GYM:
    from cellwright.envs.registration import register_tasks

    register_tasks()


def __getattr__(name: str) -> Any:
    """Load a public name at its first use.

    Raises:
        AttributeError: there is no such name.
        UsageError: it needs Gymnasium, which is not installed.
    """
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if not _HAS_GYM and name != "CellStepper":
        from cellwright.util.errors import UsageError

        raise UsageError("environments: Gymnasium is not installed; run: pip install 'cellwright[gym]'")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
