"""`cellwright operate call`: one word to a robot's node, for scripts."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import typer

from cellwright.cli.exit_status import DONE, NOT_DONE
from cellwright.cli.operate.link import NODE, Connect, Link, Node, OverRos1
from cellwright.clients.operators.orders import Ask
from cellwright.clients.operators.services import request
from cellwright.util.errors import CellwrightError, RunEndedError

_HEARD = 2.0  # [s] that a stop may take to be told of


class Word(StrEnum):
    """What can be said."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    STOP = "stop"
    CLEAR_STOP = "clear-stop"


_ASKS = {Word.HOME: Ask.HOME, Word.ENABLE: Ask.ENABLE, Word.DISABLE: Ask.DISABLE, Word.CLEAR_STOP: Ask.CLEAR_STOP}


def call(
    word: Annotated[
        Word,
        typer.Argument(
            metavar="WORD",
            help="`home`, `enable`, `disable`, `stop` (the emergency stop), or `clear-stop`.",
            show_default=False,
        ),
    ],
    connect: Connect = None,
    ros1: OverRos1 = False,
    node: Node = NODE,
) -> None:
    """Say one word to a robot's node: go home, take commands or none, stop, or end the stop.

    It ends when the node has answered: `home` when the robot is there.

        cellwright operate call home

    Exit status: 0 done; 1 the node refused, or did not answer; 2 bad input.
    """
    link = Link(connect, ros1=ros1, node=node)
    with link.robot() as robot:
        try:
            if word is Word.STOP:
                robot.stop()
                robot.session.wait_until(lambda: robot.status is not None and robot.status.emergency_stop, _HEARD)
                done = robot.status is None or bool(robot.status.emergency_stop)
                said = "stopped" if done else "sent, and the node does not say that it has stopped"
            else:
                response = robot.session.call(*request(_ASKS[word]))
                done, said = bool(response.success), str(response.message)
        except (CellwrightError, RunEndedError) as error:
            done, said = False, str(error)
    typer.echo(f"{word}: {said}" if said else word.value, err=not done)
    raise typer.Exit(DONE if done else NOT_DONE)
