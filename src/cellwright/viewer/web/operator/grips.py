"""Grippers that are moved by sliders. A message tells all of them: those that nobody moves keep their targets."""

from __future__ import annotations

from cellwright.viewer.web.operator.robot import Standing

PERIOD = 0.02
"""They are told no more often than this [s]."""
AFTERWARDS = 1.0
"""So long [s] after it was moved a slider still stands where it was put."""


class Grips:
    """The sliders of a robot's grippers: 0 open, 1 closed.

    Args:
        count: how many there are.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._wanted: dict[int, float] = {}
        self._touched: dict[int, float] = {}
        self._is_new = False
        self._sent = float("-inf")

    def ask(self, gripper: int, closed: float, now: float) -> None:
        """Somebody wants a gripper to be closed so far; what is beyond 0 and 1 is cut off."""
        self._wanted[gripper] = min(max(closed, 0.0), 1.0)
        self._touched[gripper] = now
        self._is_new = True

    def forget(self) -> bool:
        """Nothing more is to be sent; whether anything was."""
        had, self._is_new = self._is_new, False
        self._wanted.clear()
        self._touched.clear()
        return had

    def is_touched(self, gripper: int, now: float) -> bool:
        """Whether a slider stands where somebody wants it, and is not to follow its gripper."""
        return now - self._touched.get(gripper, float("-inf")) < AFTERWARDS

    def due(self, standing: Standing, now: float) -> tuple[float, ...] | None:
        """How far each gripper is to be closed, if that is to be sent now."""
        if not self._is_new or now - self._sent < PERIOD:
            return None
        self._is_new, self._sent = False, now
        return tuple(
            self._wanted[each]
            if each in self._wanted and self.is_touched(each, now)
            else standing.gripper_targets[each]
            for each in range(self._count)
        )
