"""Operator agent: a person works the arms of a cell, and is scored as a program is.

Requests come over the topics of `requests`, from the page, its keys and any program. Each control period every arm
takes one step, which goes to the cell as any program's command does. So a recording has the requests and what was
executed, and a replay needs neither the person nor this agent.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from functools import partial
from typing import Any

from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.operator.aids import BeltAid, Surroundings, snap_below
from cellwright.clients.agents.operator.control import ArmControl, Guard
from cellwright.clients.agents.operator.device import Device
from cellwright.clients.agents.operator.guard import ArmGuard
from cellwright.clients.agents.operator.requests import (
    ON,
    REPORT,
    REQUESTS,
    Command,
    JointVelocity,
    Request,
    ToJoints,
    read_request,
)
from cellwright.clients.agents.operator.tool_arms import operated_arms
from cellwright.clients.client.client import Client
from cellwright.middleware.messages.conversions import NANOSECONDS
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import CellwrightError, MessageError, RejectedCommandError, UsageError
from cellwright.util.pose import Pose

PERIOD = 0.02
"""Length of a control period [s], rounded to whole ticks of the cell."""
REPORT_PERIOD = 0.1
"""Least time [s] between two reports of the state."""
REPEAT = 1.0
"""Time [s] after which the same state is reported again."""
_FIRST = 2.0
"""Simulation time [s] in which the first joint states come."""
_GO = "go"
"""State of a competition that has begun, as that of a task does on its own."""
_NOTE = 5.0
"""Time [s] for which a note stays in the state."""

_ALWAYS = frozenset({"start", "stop", "clear", "arm", "upright", "belt"})
"""Commands that are carried out while all arms are stopped, too."""

log = logging.getLogger(__name__)


class OperatorAgent:
    """Agent that does what a person asks, over topics.

    Args:
        surroundings: parts and belts of the cell, for the aids; None where they are not known.

    Example:
        >>> from cellwright import RunOptions, run_trial
        >>> run_trial("lesson", OperatorAgent(), options=RunOptions(until=0.5)).simulated
        0.5
    """

    def __init__(self, surroundings: Surroundings | None = None) -> None:
        self._surroundings = surroundings

    def run(self, client: Client) -> None:
        """Work until the competition is done; it begins with the first request.

        Raises:
            UsageError: the cell has no arm and no robot, or none of them tells its joints.
        """
        _Work(client, self._surroundings).run()


class _Work:
    """One run of the agent."""

    def __init__(self, client: Client, surroundings: Surroundings | None) -> None:
        self._client, self._surroundings = client, surroundings
        arms = operated_arms(client)
        if not arms:
            raise UsageError("operator: the cell has no arm and no robot that a person could work; add one to its file")
        self._devices = [Device(client, each) for each in arms]
        if not client.wait_until(lambda: all(each.states.message is not None for each in self._devices), _FIRST):
            raise UsageError(f"operator: no joint states within {_FIRST:g} s; is something else in the cell's place?")
        self._layout = client.layout()
        self._controls = [ArmControl(each.operated, each.measured(), self._guard(each)) for each in self._devices]
        self._catalogue = Catalogue(client.part_types())
        self._belts = BeltAid(self._layout.belts, surroundings)
        self._meets_belt = [False] * len(arms)
        self._chosen = 0
        self._has_begun = self._is_stopped = False
        self._note, self._noted = "", 0.0
        self._inbox: list[tuple[str, Any]] = []
        self._reported, self._report_time = "", 0
        self._commands: dict[str, Callable[[str], None]] = {
            "start": self._start,
            "stop": self._stop,
            "clear": self._clear,
            "arm": self._choose,
            "upright": self._keep_upright,
            "belt": self._meet_belt,
            "hold": self._hold,
            "home": self._go_home,
            "snap": self._snap,
        }
        numerator, denominator = client.timestep()
        tick = numerator * NANOSECONDS / denominator
        self._period = round(max(1, round(PERIOD * NANOSECONDS / tick)) * tick)

    def run(self) -> None:
        """Take requests and steps until the competition is done."""
        client = self._client
        for topic in REQUESTS:
            client.subscribe(topic, partial(self._keep, topic), passive=True)
        due = client.transport.now()
        while client.competition_state != "done":
            inbox, self._inbox = self._inbox, []
            for topic, message in inbox:
                self._take(topic, message)
            self._step()
            self._report()
            now = client.transport.now()
            # a cell that runs ahead of its clients: late steps are not made up for, since each takes a whole period
            due = max(due + self._period, now)
            client.sleep((due - now) / NANOSECONDS)

    def _guard(self, device: Device) -> Guard | None:
        """Return the guard of an arm; None where the cell does not describe its shapes, or its place."""
        arm = device.operated.arm
        if arm is None or not device.operated.has_place:
            return None
        chain = self._client.chains()[arm.name]
        return ArmGuard(self._client.solids(), chain, arm, self._layout.arms, device.measured()).refusal

    def _keep(self, topic: str, message: Any) -> None:
        self._inbox.append((topic, message))

    def _take(self, topic: str, message: Any) -> None:
        try:
            request = read_request(topic, message)
            begins = not isinstance(request, Command) or request.name == "start" or request.name not in _ALWAYS
            if begins and not self._has_begun:
                self._has_begun = True
                self._client.start_competition()
            self._do(request)
        except CellwrightError as error:
            self._say(str(error))

    def _do(self, request: Request) -> None:
        """Carry out a request.

        Raises:
            CellwrightError: it cannot be carried out now.
        """
        if isinstance(request, Command) and request.name in _ALWAYS:
            self._commands[request.name](request.word)
            return
        if self._is_stopped:
            raise MessageError("stopped: nothing moves until the command clear")
        now = self._client.time
        if isinstance(request, Command):
            self._commands[request.name](request.word)
        elif isinstance(request, ToJoints | JointVelocity):
            self._of_joints(request).take(request, now)
        else:
            self._control.take(request, now)

    @property
    def _control(self) -> ArmControl:
        """The chosen arm."""
        return self._controls[self._chosen]

    def _of_joints(self, request: ToJoints | JointVelocity) -> ArmControl:
        """Return the arm that a request for joints means: the chosen one if it has the first of them."""
        first = next(iter(request.positions if isinstance(request, ToJoints) else request.velocities))
        having = [each for each in (self._control, *self._controls) if first in each.arm.joints]
        return having[0] if having else self._control

    def _start(self, _word: str) -> None:
        """Do nothing more: the first request has started the competition."""

    def _stop(self, _word: str) -> None:
        self._is_stopped = True
        for device, control in zip(self._devices, self._controls, strict=True):
            control.stop()
            device.stop()
        self._say("stopped")

    def _clear(self, _word: str) -> None:
        self._is_stopped = False
        self._say("")

    def _choose(self, name: str) -> None:
        names = [each.arm.name for each in self._controls]
        if name not in names:
            raise MessageError(f"arm: unknown (got {name:.40}); give one of {', '.join(names)}")
        self._chosen = names.index(name)

    def _keep_upright(self, word: str) -> None:
        if word == ON and not self._control.arm.can_be_upright:
            raise MessageError(f"upright: it is not known which way the tool of {self._control.arm.name} points")
        self._control.is_upright = word == ON

    def _meet_belt(self, word: str) -> None:
        self._meets_belt[self._chosen] = word == ON

    def _hold(self, _word: str) -> None:
        self._control.stop()
        self._devices[self._chosen].stop()

    def _go_home(self, _word: str) -> None:
        self._control.go_home()

    def _snap(self, _word: str) -> None:
        control, device = self._control, self._devices[self._chosen]
        tool = control.arm.world_T_tool(device.measured())
        snap = snap_below(control.arm, tool, self._surroundings, self._catalogue, device.has_part)
        control.go_to(snap)
        self._say(f"snap: {snap.name}")

    def _step(self) -> None:
        now, period = self._client.time, self._period / NANOSECONDS
        for device, control, meets in zip(self._devices, self._controls, self._meets_belt, strict=True):
            control.see(device.measured())
            if self._is_stopped:
                continue
            drift = self._belts.velocity(control.world_T_tool) if meets else (0.0, 0.0, 0.0)
            targets = control.step(now, period, drift)
            try:
                if targets is not None:
                    device.send(targets, period)
            except RejectedCommandError as error:
                control.stop()
                self._say(str(error))

    def _say(self, text: str) -> None:
        self._note, self._noted = text, self._client.time
        if text:
            log.info("operator: %s", text)

    def _report(self) -> None:
        """Report the state, if it has changed."""
        now = self._client.transport.now()
        if self._reported and now - self._report_time < REPORT_PERIOD * NANOSECONDS:
            return
        if self._note and not self._is_stopped and self._client.time - self._noted > _NOTE:
            self._note = ""
        text = json.dumps(self._state())
        if text != self._reported or now - self._report_time >= REPEAT * NANOSECONDS:
            self._reported, self._report_time = text, now
            self._client.publish(REPORT, String(text))

    def _state(self) -> dict[str, Any]:
        return {
            "arm": self._control.arm.name,
            "stopped": self._is_stopped,
            "begun": self._has_begun or self._client.competition_state == _GO,
            "note": self._note,
            "arms": {
                each.arm.name: {
                    "mode": str(each.mode),
                    "why": each.why,
                    "upright": each.is_upright,
                    "belt": meets,
                    "aim": None if each.aim is None else _numbers(each.aim),
                    "joints": [round(value, 4) for value in each.measured],
                }
                for each, meets in zip(self._controls, self._meets_belt, strict=True)
            },
        }


def _numbers(pose: Pose) -> list[float]:
    return [round(each, 4) for each in (*pose.position, *pose.quaternion)]
