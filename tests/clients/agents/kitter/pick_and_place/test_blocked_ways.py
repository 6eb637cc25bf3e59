"""Hand with an arm that something is in the way of."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Held, Manipulator
from cellwright.clients.client import Client
from cellwright.util.pose import Pose
from tests.clients.agents.kitter.places import ARM, WORKPLACE


class BlockedArm:
    """An arm that reaches everything, but does not go down, or does not roll; it notes what it does."""

    safe = 0.95
    heights = ARM.figures.heights
    tool = Pose((0.0, 0.0, 1.0))

    def __init__(self, *, goes_down: bool, is_holding: bool) -> None:
        self.goes_down = goes_down
        self.is_holding = is_holding
        self.done: list[str] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def act(*_arguments: Any) -> Any:
            self.done.append(name)
            return {"line": self.goes_down, "roll": False, "clear_posture": (0.0,) * 7}.get(name, True)

        return act

    def grip(self, enable: bool) -> None:
        self.done.append("grip" if enable else "let go")


def blocked_hand(*, goes_down: bool, holds: bool = False) -> tuple[Manipulator, BlockedArm]:
    arm = BlockedArm(goes_down=goes_down, is_holding=goes_down or holds)
    client = SimpleNamespace(time=0.0, sleep=lambda _duration: None, wait_until=lambda condition, _timeout: condition())
    return Manipulator(cast("Client", client), cast("KitterArm", arm), Catalogue(), WORKPLACE), arm


def test_cup_does_not_press_where_the_way_down_is_blocked() -> None:
    hand, arm = blocked_hand(goes_down=False)
    assert hand.from_rest("gear_part", Pose((-0.3, 0.2, 0.725)), 0.0) is None
    assert not hand.turn_over("pulley_part", Pose((0.3, 3.15, 0.755)), 0.0, 2.1)
    assert arm.done.count("line") == 2
    assert "press" not in arm.done


def test_part_that_cannot_be_rolled_is_not_turned_over() -> None:
    hand, arm = blocked_hand(goes_down=True)
    assert not hand.turn_over("pulley_part", Pose((0.3, 3.15, 0.755)), 0.0, 2.1)
    assert arm.done.count("roll") == 1


def test_part_whose_way_down_is_blocked_falls_on_the_floor_and_not_on_the_tray() -> None:
    hand, arm = blocked_hand(goes_down=False, holds=True)
    held = Held("gear_part", Pose((0.0, 0.0, -0.02)))
    assert not hand.put_down(held, Pose((0.3, 3.15, 0.755)), 2.1)
    assert arm.done[-4:] == ["travel", "line", "travel", "let go"]
