"""Command `cellwright operate call`: one command to a robot's node."""

from enum import StrEnum
from typing import Annotated

import typer

from cellwright.cli.main import DONE, NOT_DONE
from cellwright.cli.operate.connection import NODE, AddressArguments, Node, NodeConnection
from cellwright.cli.output import echo
from cellwright.cli.parameters import argument, with_groups
from cellwright.clients.operators.robot import Ask, Now, service_request
from cellwright.util.errors import CellwrightError, RunEndedError

_STOP_TIMEOUT = 2.0  # [s] that the report of a stop may take


class NodeCommand(StrEnum):
    """Command of `cellwright operate call` to a robot's node."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    STOP = "stop"
    CLEAR_STOP = "clear-stop"


@with_groups
def call(
    command: Annotated[
        NodeCommand, argument("COMMAND", "`home`, `enable`, `disable`, `stop` (the emergency stop), or `clear-stop`.")
    ],
    address: AddressArguments,
    node: Node = NODE,
) -> None:
    """Send one command to a robot's node: go home, enable or disable commands, stop, or clear the stop.

    It returns when the node has answered; for `home`, when the robot has arrived.

        cellwright operate call home

    Exit status: 0 done; 1 the node refused, or did not answer; 2 bad input.
    """
    with NodeConnection(address, node).robot() as robot:
        try:
            if command is NodeCommand.STOP:
                robot.send(Now.STOP)
                robot.session.wait_until(
                    lambda: robot.status is not None and robot.status.emergency_stop, _STOP_TIMEOUT
                )
                done = robot.status is None or bool(robot.status.emergency_stop)
                text = "stopped" if done else "sent, but the node has not reported the stop"
            else:
                response = robot.session.call(*service_request(Ask[command.name]))
                done, text = bool(response.success), str(response.message)
        except (CellwrightError, RunEndedError) as error:
            done, text = False, str(error)
    echo(f"{command}: {text}" if text else command.value, err=not done)
    raise typer.Exit(DONE if done else NOT_DONE)
