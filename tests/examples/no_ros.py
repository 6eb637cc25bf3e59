"""Stand-in for ROS that loads the example of a controller node, and calls it."""

import sys
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from time import sleep
from typing import Any

import pytest


@dataclass
class Graph:
    """Registrations and published messages of a node."""

    subscribers: dict[str, Callable[[Any], None]] = field(default_factory=dict)
    services: dict[str, Callable[[Any], Any]] = field(default_factory=dict)
    published: dict[str, list[Any]] = field(default_factory=dict)
    is_over: bool = False


def install(monkeypatch: pytest.MonkeyPatch, package: Path) -> Graph:
    """Put modules of these names in place of ROS's.

    Args:
        monkeypatch: takes them away again.
        package: folder of all packages.
    """
    graph = Graph()

    class Publisher:
        def __init__(self, topic: str, _kind: type, queue_size: int) -> None:
            assert queue_size == 1
            self.messages = graph.published.setdefault(topic, [])

        def publish(self, message: Any) -> None:
            self.messages.append(message)

    class Rate:
        def __init__(self, hertz: float) -> None:
            self.period = 1.0 / hertz

        def sleep(self) -> None:
            sleep(self.period)  # stands for no condition: it is what a rate does

    modules: dict[str, dict[str, Any]] = {
        "rospy": {
            "Publisher": Publisher,
            "Subscriber": lambda topic, _kind, callback: graph.subscribers.update({topic: callback}),
            "Service": lambda name, _kind, handler: graph.services.update({name: handler}),
            "Rate": Rate,
            "is_shutdown": lambda: graph.is_over,
            "Time": types.SimpleNamespace(now=lambda: 7),
            "ROSInterruptException": KeyboardInterrupt,
        },
        "rospkg": {"RosPack": lambda: types.SimpleNamespace(get_path=lambda _name: str(package))},
        "geometry_msgs.msg": {"Vector3": types.SimpleNamespace},
        "sensor_msgs.msg": {"JointState": lambda: types.SimpleNamespace(header=types.SimpleNamespace())},
        "std_srvs.srv": {"Trigger": object, "TriggerResponse": types.SimpleNamespace},
    }
    for name, content in modules.items():
        module = types.ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    for name in ("geometry_msgs", "sensor_msgs", "std_srvs"):
        monkeypatch.setitem(sys.modules, name, types.ModuleType(name))
    return graph
