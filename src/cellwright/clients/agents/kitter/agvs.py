"""Which AGVs are there to be loaded."""

from __future__ import annotations

from cellwright.clients.agents.kitter.placing import STATIONS
from cellwright.clients.client import Client, Latest


class AgvStates:
    """The states of the AGVs, while they are listened to: each tells its state in every step.

    Args:
        client: whose AGVs.
    """

    def __init__(self, client: Client) -> None:
        self._client = client
        self._states: dict[int, Latest] = {}

    def listen(self) -> None:
        """Hear the states from now on."""
        for number in STATIONS:
            if number not in self._states:
                self._states[number] = self._client.latest(f"/ariac/agv{number}/state")

    def rest(self) -> None:
        """Hear no more of them, and forget them."""
        for state in self._states.values():
            state.cancel()
        self._states.clear()

    def is_ready(self, number: int) -> bool:
        """Whether an AGV said last that it stands at its load point."""
        state = self._states.get(number)
        return state is not None and state.message is not None and state.message.data == "ready_to_deliver"
