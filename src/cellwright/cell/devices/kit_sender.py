"""Submission of what lies on a tray as a kit: the part that AGVs and fixed trays have in common, and fixed trays."""

from collections.abc import Callable
from typing import ClassVar, Literal, TypeAlias

from cellwright.cell.devices.kit_tray import KitTray
from cellwright.engine.device import Device

PREPARATION = 0.75
"""Time between the call and the submission [s] (ARIAC 2017: until an AGV departs)."""
SenderState: TypeAlias = Literal["ready_to_deliver", "preparing_to_deliver", "delivering", "delivered", "returning"]


class KitSender(Device):
    """Device that submits what is on its tray as a kit, 0.75 s after a call; `on_submit` gets the kit type."""

    STATE: ClassVar[tuple[str, ...]] = ("state", "kit_type")

    def __init__(self, name: str, tray: KitTray) -> None:
        super().__init__(name)
        self.number = tray.number
        self.tray = tray
        self.state: SenderState = "ready_to_deliver"
        self.kit_type = ""
        self.on_submit: list[Callable[[KitSender, str], None]] = []

    def reset(self) -> None:
        """Begin a run: ready, with nothing submitted."""
        self.state = "ready_to_deliver"
        self.kit_type = ""

    @property
    def holds_unsent_kit(self) -> bool:
        """True if what lies on its tray is not submitted yet."""
        return self.state in ("ready_to_deliver", "preparing_to_deliver")

    def send(self, kit_type: str) -> bool:
        """Request delivery of its tray as a kit of this type; return False unless it is ready."""
        if self.state != "ready_to_deliver":
            return False
        self.state = "preparing_to_deliver"
        self.kit_type = kit_type
        self.simulation.schedule(self, "depart", delay=PREPARATION)
        return True

    def submit(self) -> None:
        """Submit the kit."""
        for listener in self.on_submit:
            listener(self, self.kit_type)


class FixedTray(KitSender):
    """Sender of a tray that does not move: the kit is taken out of the cell where it stands, and the tray is ready."""

    def handle_depart(self) -> None:
        """Submit the kit, and take it out."""
        self.submit()
        self.state = "delivered"
        self.tray.take_out()
        self.simulation.schedule(self, "turn", at=self.simulation.now + 1)

    def handle_turn(self) -> None:
        """Be ready for the next kit."""
        self.state = "ready_to_deliver"
