"""Services that tools of ROS 2 expect: `simulation_interfaces` with its action; and how services of the server pass.

The cell has them as services of its server. Messages pass as JSON values by field name, so that every version of a
package is served: that which this Python has. Without the package, or with a cell that has no such services, as a
recording, nothing is offered.
"""

from __future__ import annotations

import contextlib
import json
import re
from collections import deque
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any

from rclpy.action import CancelResponse

from cellwright.middleware.ros2.bridge.coroutines import Answer
from cellwright.middleware.ros2.bridge.interfaces import fill, values_of
from cellwright.middleware.ros2.bridge.node import RosNode, quality
from cellwright.middleware.ros2.bridge.receiver import Respond
from cellwright.middleware.ros2.bridge.services import CellCalls
from cellwright.middleware.ros2.bridge.versions import in_version
from cellwright.middleware.wire.frames import Frame, FrameKind

SIMULATION, FEATURES = "simulation/", "simulation/GetSimulatorFeatures"
SERVICES = (
    *("GetSimulatorFeatures", "GetSimulationState", "SetSimulationState", "ResetSimulation", "StepSimulation"),
    *("GetEntities", "GetEntitiesStates", "GetEntityInfo", "SetEntityInfo", "GetEntityState", "SetEntityState"),
    *("GetEntityBounds", "GetNamedPoses", "GetNamedPoseBounds", "GetSpawnables", "SpawnEntity", "DeleteEntity"),
    *("SpawnEntities", "GetCurrentWorld", "GetAvailableWorlds", "LoadWorld", "UnloadWorld"),
)
"""Services of a cell. A robot answers FEATURE_UNSUPPORTED to those of entities and worlds."""

UNSUPPORTED, OK, FAILED = 0, 1, 4
"""Codes of `simulation_interfaces/Result`."""

FEEDBACK_DEPTH = 1000
"""Messages of feedback that are kept for a slow client: there is one for each step."""

MAX_AHEAD = 8
"""Single steps that are requested ahead: time need not stand while an answer travels."""


class ServerServices:
    """Services of the cell's server in ROS 2, under the names of their types in lower case: `get_entities`.

    Args:
        ros: the node.
        calls: calls of the cell.
        package: package of the types.
        prefix: prefix of the names on the server.
        names: types.
        refused: returns the values of a response that refuses.
        node: a further node, which has them under its own name.

    Raises:
        ImportError: this Python has no such package.
    """

    def __init__(
        self,
        ros: RosNode,
        calls: CellCalls,
        package: str,
        prefix: str,
        names: tuple[str, ...],
        refused: Callable[[Frame], dict[str, Any]],
        node: Any = None,
    ) -> None:
        self._calls = calls
        self._prefix = prefix
        self._refused = refused
        types = import_module(f"{package}.srv")
        for name in names:
            if (kind := getattr(types, name, None)) is not None:
                prefixed = f"{'' if node is None else '~/'}{in_lower_case(name)}"
                ros.receiver.serve(kind, prefixed, self._server(name, kind), node=node)

    def _server(self, name: str, kind: Any) -> Callable[[Any, Respond], None]:
        def serve(request: Any, respond: Respond) -> None:
            def answered(values: Mapping[str, Any]) -> None:
                response = kind.Response()
                self.before_answer()
                respond(fill(response, in_version(response, values)))

            self.ask(name, values_of(request), answered)

        return serve

    def before_answer(self) -> None:
        """Publish the time that an answer is about."""
        self._calls.before_answer()

    def ask(self, name: str, request: Mapping[str, Any], answered: Callable[[dict[str, Any]], object]) -> None:
        """Call a service; `answered` gets the values of the response."""

        def heard(frame: Frame) -> None:
            answered(frame.json() if frame.kind is FrameKind.ANSWER else self._refused(frame))

        self._calls.ask(f"{self._prefix}{name}", "", json.dumps(request).encode(), heard)


class StepAction:
    """The action `simulate_steps`, which steps a paused simulation."""

    def __init__(self, ros: RosNode, services: ServerServices) -> None:
        self._services = services
        self._steps = import_module("simulation_interfaces.action").SimulateSteps
        ros.receiver.offer(
            self._steps,
            "simulate_steps",
            self._simulate,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
            feedback_pub_qos_profile=quality(is_reliable=True, is_transient_local=False, depth=FEEDBACK_DEPTH),
        )

    async def _simulate(self, goal: Any) -> Any:
        """Step one by one, with feedback after each; a cancelled goal ends after the requested steps."""
        wanted, done, requested = int(goal.request.steps), 0, 0
        feedback = self._steps.Feedback()
        result: dict[str, Any] = {"result": OK, "error_message": ""}
        waiting: deque[Answer] = deque()
        while True:
            is_going_on = result["result"] == OK and not goal.is_cancel_requested
            while is_going_on and len(waiting) < MAX_AHEAD and requested < max(wanted, 1):
                answered = Answer()
                requested += 1
                self._services.ask("StepSimulation", {"steps": min(wanted, 1)}, answered.give)  # none is refused
                waiting.append(answered)
            if not waiting:
                break
            found = (await waiting.popleft())["result"]
            if found["result"] != OK:
                result = result if result["result"] != OK else found
                continue
            done += 1
            feedback.completed_steps, feedback.remaining_steps = done, wanted - done
            goal.publish_feedback(feedback)
        self._services.before_answer()
        if result["result"] != OK:
            goal.abort()
        elif done == wanted:
            goal.succeed()
        else:
            goal.canceled()
        return fill(self._steps.Result(), {"result": result})


def offer_standard_services(ros: RosNode, calls: CellCalls, has: Mapping[str, Any]) -> list[object]:
    """Offer what the cell has and this Python has packages for; return the ends, to be kept.

    Args:
        ros: the node.
        calls: calls of the cell.
        has: answer of the cell to the service FEATURES; empty if it has none.
    """
    offered: list[object] = []
    if has[FEATURES]:
        with contextlib.suppress(ImportError):
            services = ServerServices(ros, calls, "simulation_interfaces", SIMULATION, SERVICES, _failed)
            offered += [services, StepAction(ros, services)]
    return offered


def in_lower_case(name: str) -> str:
    """Return the name of a service for that of its type: `get_entities` for `GetEntities`."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def _failed(refused: Frame) -> dict[str, Any]:
    code = UNSUPPORTED if refused.name == "UnknownNameError" else FAILED
    return {"result": {"result": code, "error_message": " ".join(refused.text().split())}}
