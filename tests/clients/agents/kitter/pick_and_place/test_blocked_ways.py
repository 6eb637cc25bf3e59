"""Hand with an arm that something is in the way of."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

from cellwright.clients.agents.kitter.arm import KitterArm
from cellwright.clients.agents.kitter.part_figures import Catalogue
from cellwright.clients.agents.kitter.pick_and_place import Held, Manipulator
from cellwright.clients.client import Client
from cellwright.util.pose import Pose


class BlockedArm:
    """An arm that reaches everything, but does not go down, or does not roll; it notes what it does."""

    safe = 0.95
    tool = Pose((0.0, 0.0, 1.0))

    def __init__(self, *, goes_down: bool) -> None:
        self.goes_down = goes_down
        self.done: list[str] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def act(*_arguments: Any) -> Any:
            self.done.append(name)
            return {"line": self.goes_down, "roll": False, "clear_rail": 0.0}.get(name, True)

        return act


def blocked_hand(*, goes_down: bool, holds: bool = False) -> tuple[Manipulator, BlockedArm]:
    arm = BlockedArm(goes_down=goes_down)
    client = SimpleNamespace(
        gripper_attached=goes_down or holds,
        time=0.0,
        control_gripper=lambda enable: arm.done.append("grip" if enable else "let go"),
        sleep=lambda _duration: None,
        wait_until=lambda condition, _timeout: condition(),
    )
    beside = [(-0.15, 2.2, 1.5)]
    return Manipulator(cast("Client", client), cast("KitterArm", arm), Catalogue(), beside), arm


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
