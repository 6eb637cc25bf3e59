"""The keyboard operator: keys in, orders out, and a picture of the robot ten times a second."""

from __future__ import annotations

from collections.abc import Callable

from cellwright.clients.operators.jog import Jog
from cellwright.clients.operators.keys import KeyDecoder
from cellwright.clients.operators.orders import Ask, MoveGrippers, MoveJoints, MoveTips, Now, Order
from cellwright.clients.operators.robot import OperatedRobot
from cellwright.clients.operators.services import Services
from cellwright.util.errors import CellwrightError

LOOK = 0.02
"""Between two looks at the keyboard [s]."""
REDRAW = 5
"""Looks from one picture to the next."""
MOST_STEPS = 3
"""Steps that are taken of one look: what piled up while something stalled is old, and is dropped."""


class Keyboard:
    """Drives a robot by keys.

    Args:
        robot: that is driven.
        jog: makes orders of keys.
        services: calls its services.
    """

    def __init__(self, robot: OperatedRobot, jog: Jog, services: Services) -> None:
        self.robot = robot
        self.jog = jog
        self.services = services
        self.message = ""
        """What there is to tell, in a sentence."""
        self._decoder = KeyDecoder()

    def run(self, read: Callable[[], str], draw: Callable[[], None]) -> None:
        """Drive until somebody wants to quit.

        Args:
            read: what has been typed since the last call; never waits.
            draw: shows how things are.

        Raises:
            RunEndedError: the node is gone.
        """
        looks = 0
        while self.take(read()):
            if looks % REDRAW == 0:
                draw()
            looks += 1
            self.robot.session.sleep(LOOK)

    def take(self, text: str) -> bool:
        """Do what has been typed; False when that is to quit."""
        answer = self.services.answer()
        if answer:
            self.message = answer
            self.jog.forget()
        status = self.robot.status
        if self.robot.why_not() or (status is not None and status.silent):
            self.jog.forget()  # the node holds the robot where it is
        keys = self._decoder.feed(text)
        if " " in keys:  # nothing that was typed before it comes first
            keys = keys[keys.index(" ") :]
        steps = 0
        for key in keys:
            order = self.jog.press(key)
            self.message = self.jog.note or ("" if order is None and self.jog.search is None else self.message)
            if order is Now.QUIT:
                return False
            if isinstance(order, MoveJoints | MoveTips | MoveGrippers):
                steps += 1
                if steps > MOST_STEPS:
                    self.jog.forget()
                    self.message = "keys came faster than the robot could be told; the oldest were taken"
                    continue
            if order is not None:
                self._carry_out(order)
        return True

    def _carry_out(self, order: Order) -> None:
        try:
            self._tell(order)
        except CellwrightError as error:  # refused; RunEndedError is none of these
            self.jog.forget()
            self.message = str(error)

    def _tell(self, order: Order) -> None:
        match order:
            case MoveJoints():
                self.robot.send_joints(order.targets)
                self.message = self.jog.note
            case MoveTips():
                self.robot.send_tips(order.tips)
                self.message = self.jog.note
            case MoveGrippers():
                self.robot.send_grippers(order.closed)
                self.message = self.jog.note
            case Now.STOP:
                self.robot.stop()
                self.message = "EMERGENCY STOP sent; u ends it"
            case Ask():
                begun = self.services.begin(order)
                self.message = f"{order.value} …" if begun else f"still waiting for: {self.services.under_way}"
            case Now.QUIT:
                pass
