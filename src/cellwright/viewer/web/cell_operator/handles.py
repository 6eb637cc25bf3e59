"""Handles at the tools of a cell's arms, in viser's scene."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cellwright.clients.agents.operator.requests import POSE, pose_request
from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.util.pose import IDENTITY_QUATERNION, Pose
from cellwright.viewer.web.cell_operator.arms import ArmReport, OperatorState
from cellwright.viewer.web.cell_operator.sender import Sender
from cellwright.viewer.web.operator.handles import BESIDE, SHORT, put
from cellwright.viewer.web.operator.moves import HeldHandle
from cellwright.viewer.web.operator.robot_state import pose_of

_SIZE = 0.3  # [m] of a handle
_RADIUS = 0.03  # [m] of a ghost
_MAX_STEP = 50.0  # [m] from the origin: a handle farther away is a mistake


@dataclass(slots=True)
class _ToolHandle:
    handle: Any
    ghost: Any
    held: HeldHandle | None = None


class ToolHandles:
    """Handle for the tool of each arm, below the node `root`; drags go to the sender."""

    def __init__(self, scene: Any, root: str, arms: Mapping[str, OperatedArm], sender: Sender) -> None:
        self._arms, self._sender = arms, sender
        self._state: OperatorState | None = None
        names = [name for name, arm in arms.items() if arm.has_place]
        self._handles = {
            name: self._made(scene, f"{root}/operator/{number}", name) for number, name in enumerate(names)
        }

    def show(self, state: OperatorState | None) -> None:
        """Show the arms where they are; without a state, hide all."""
        self._state = state
        for name, each in self._handles.items():
            report = None if state is None else state.arms.get(name)
            is_of_use = report is not None and state is not None and not state.is_stopped
            each.handle.visible = is_of_use
            each.ghost.visible = report is not None and report.aim is not None
            if not is_of_use:
                each.held = None
            if report is None:
                continue
            if each.held is None:
                put(each.handle, Pose(self._tool(name, report).position, IDENTITY_QUATERNION))
            if report.aim is not None:
                put(each.ghost, report.aim)
                each.ghost.color = SHORT if report.why else BESIDE

    def _made(self, scene: Any, name: str, arm: str) -> _ToolHandle:
        handle = scene.add_transform_controls(
            f"{name}/handle", scale=_SIZE, line_width=3.0, depth_test=False, opacity=0.9, visible=False
        )
        ghost = scene.add_icosphere(
            f"{name}/ghost", radius=_RADIUS, color=BESIDE, opacity=0.55, visible=False, cast_shadow=False
        )

        # viser calls this in the event loop, so that events keep their order
        async def act(event: Any) -> None:
            self._act(arm, event)

        handle.on_update(act)
        return _ToolHandle(handle, ghost)

    def _act(self, arm: str, event: Any) -> None:
        each, browser = self._handles[arm], int(event.client_id)
        if event.phase == "end":
            if each.held is not None and each.held.browser == browser:
                each.held = None
            return
        try:
            world_T_handle = pose_of((*event.target.position, *event.target.wxyz))
        except ValueError:
            return  # a browser may send anything
        if event.phase == "start":
            self._grab(arm, browser, world_T_handle)
            return
        held = each.held
        if held is None or held.browser != browser or max(map(abs, world_T_handle.position)) > _MAX_STEP:
            return
        held.follow(world_T_handle)
        if held.pose is not None:
            self._sender.put(POSE, pose_request(held.pose))

    def _grab(self, arm: str, browser: int, handle: Pose) -> None:
        """Begin a drag, from where the tool is, or goes; one browser has a handle at a time."""
        state, each = self._state, self._handles[arm]
        report = None if state is None else state.arms.get(arm)
        if state is None or report is None or state.is_stopped or (each.held and each.held.browser != browser):
            return
        each.held = HeldHandle(browser, handle, report.aim or self._tool(arm, report))
        if state.arm != arm:
            self._sender.command(f"arm {arm}")

    def _tool(self, arm: str, report: ArmReport) -> Pose:
        return self._arms[arm].world_T_tool(report.joints)
