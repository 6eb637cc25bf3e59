"""Test data of the project, and additional cases of users in $CELLWRIGHT_EXTRA_CASES."""

import gc
import json
import os
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, settings

# Where glfw is installed the engine loads it, which starts another Python; our own windows load it themselves.
os.environ.setdefault("MUJOCO_GL", "disable")

# A slow machine is no failure; and CI judges the commit, independent of random examples.
settings.register_profile(
    "cellwright", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("cellwright")

pytest_plugins = [
    "tests.support.required",
    "tests.support.leftovers",
    "tests.support.warm",
    "tests.support.quick_children",
    "tests.support.run_report",
    "tests.support.schedule",
]

# Collection creates a million objects that stay until the end; garbage collection among them would find none.
gc.disable()


def pytest_collection_finish() -> None:
    gc.enable()
    gc.freeze()


DATA = Path(__file__).parent / "data"


def load_cases(name: str) -> list[dict[str, Any]]:
    """Return the cases of tests/data/<name> and of every file of that name in $CELLWRIGHT_EXTRA_CASES."""
    folders = [DATA]
    if extra := os.environ.get("CELLWRIGHT_EXTRA_CASES"):
        folders.append(Path(extra))
    cases: list[dict[str, Any]] = []
    for folder in folders:
        path = folder / name
        if path.exists():
            cases += json.loads(path.read_text())["cases"]
    return cases
