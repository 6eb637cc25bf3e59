"""Services and the action of the standard `simulation_interfaces`, over services of the cell's server.

Messages pass as JSON values by field name, so version 1 and 2 of the package are served alike: whichever this Python
has. Without the package, or with a cell that has no such services, as a recording, nothing is offered.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib import import_module
from typing import Any

from rclpy.action import ActionServer, CancelResponse

from cellwright.middleware.ros2.bridge.interfaces import fill, values_of
from cellwright.middleware.ros2.bridge.node import RosNode
from cellwright.middleware.ros2.bridge.services import CellCall
from cellwright.middleware.wire.frames import Frame, FrameKind

PACKAGE, PREFIX, FEATURES = "simulation_interfaces", "simulation/", "simulation/GetSimulatorFeatures"

SERVICES = (
    *("GetSimulatorFeatures", "GetSimulationState", "SetSimulationState", "ResetSimulation", "StepSimulation"),
    *("GetEntities", "GetEntitiesStates", "GetEntityInfo", "SetEntityInfo", "GetEntityState", "SetEntityState"),
    *("GetEntityBounds", "GetNamedPoses", "GetNamedPoseBounds", "GetSpawnables", "SpawnEntity", "DeleteEntity"),
    *("GetCurrentWorld", "GetAvailableWorlds"),
)
"""Services that a cell has. A robot answers FEATURE_UNSUPPORTED to those of entities and worlds."""

UNSUPPORTED, OK, FAILED = 0, 1, 4
"""Codes of `simulation_interfaces/Result`."""

CHUNK = 50
"""Steps between two messages of feedback."""


class SimulationServices:
    """The standard's services under their names in lower case, `/get_entities`, and the action `/simulate_steps`."""

    def __init__(self, ros: RosNode, calls: CellCall) -> None:
        self._calls = calls
        services = import_module(f"{PACKAGE}.srv")
        self._services = [
            ros.node.create_service(
                getattr(services, name), in_lower_case(name), self._server(name), callback_group=ros.group
            )
            for name in SERVICES
            if hasattr(services, name)
        ]
        self._steps = import_module(f"{PACKAGE}.action").SimulateSteps
        self._action = ActionServer(
            ros.node,
            self._steps,
            "simulate_steps",
            self._simulate,
            cancel_callback=lambda _goal: CancelResponse.ACCEPT,
            callback_group=ros.group,
        )

    def _server(self, name: str) -> Any:
        async def serve(request: Any, response: Any) -> Any:
            return fill(response, await self._ask(name, values_of(request)))

        return serve

    async def _ask(self, name: str, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return the cell's answer; a refusal becomes a result."""
        frame = await self._calls.ask(f"{PREFIX}{name}", "", json.dumps(request).encode())
        if frame.kind is FrameKind.ANSWER:
            values: dict[str, Any] = frame.json()
            return values
        return {"result": {"result": _code_of(frame), "error_message": " ".join(frame.text().split())}}

    async def _simulate(self, goal: Any) -> Any:
        """Step in parts, with feedback after each; a cancelled goal ends after the present part."""
        wanted, done = int(goal.request.steps), 0
        answer: dict[str, Any] = {"result": {"result": OK, "error_message": ""}}
        while done < wanted and not goal.is_cancel_requested:
            part = min(CHUNK, wanted - done)
            answer = await self._ask("StepSimulation", {"steps": part})
            if answer["result"]["result"] != OK:
                break
            done += part
            feedback = self._steps.Feedback()
            feedback.completed_steps, feedback.remaining_steps = done, wanted - done
            goal.publish_feedback(feedback)
        if done == wanted:
            goal.succeed()
        elif goal.is_cancel_requested:
            goal.canceled()
        else:
            goal.abort()
        return fill(self._steps.Result(), answer)


def offer_simulation(ros: RosNode, calls: CellCall, features: Mapping[str, Any] | None) -> SimulationServices | None:
    """Offer the services if the cell has features and this Python the package; None else."""
    if not features:
        return None
    try:
        return SimulationServices(ros, calls)
    except ImportError:
        return None


def in_lower_case(name: str) -> str:
    """Return the name of a service for that of its type: `get_entities` for `GetEntities`."""
    return re.sub(r"(?<!^)(?=[A-Z])", "_", name).lower()


def _code_of(refused: Frame) -> int:
    return UNSUPPORTED if refused.name == "UnknownNameError" else FAILED
