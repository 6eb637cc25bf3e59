"""Stand-in for what the environments for LeRobot need of it: the base of configurations, and the types of features."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import StrEnum
from types import ModuleType
from typing import Any


class FeatureType(StrEnum):
    STATE = "STATE"
    VISUAL = "VISUAL"
    ENV = "ENV"
    ACTION = "ACTION"


@dataclass
class PolicyFeature:
    type: FeatureType
    shape: tuple[int, ...]


@dataclass
class EnvConfig:
    task: str | None = None
    fps: int = 30
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)
    max_parallel_tasks: int = 1
    disable_env_checker: bool = True

    @classmethod
    def register_subclass(cls, name: str) -> Callable[[Any], Any]:
        return lambda registered: KNOWN.setdefault(name, registered)


KNOWN: dict[str, Any] = {}
"""Configurations by the names that they are registered under."""


def modules() -> dict[str, ModuleType]:
    """Return the modules of LeRobot, for `sys.modules`: each has all names of this file."""
    return dict.fromkeys(
        ("lerobot", "lerobot.configs", "lerobot.configs.types", "lerobot.envs", "lerobot.envs.configs"),
        sys.modules[__name__],
    )
