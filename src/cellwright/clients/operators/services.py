"""A robot node's services, called without making the operator wait: an emergency stop must get through meanwhile."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from cellwright.clients.client.session import Session
from cellwright.clients.operators.orders import Ask
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.util.errors import CellwrightError, RunEndedError

HOME = "/io_teleop_reset_robot"
ENABLE = "/io_teleop/set_enabled"
CLEAR_STOP = "/io_teleop/clear_emergency_stop"


class Services:
    """Calls one service at a time, in a thread, over a connection of its own.

    Args:
        open_session: makes that connection; called in the thread, when it is needed first.
    """

    def __init__(self, open_session: Callable[[], Session]) -> None:
        self._open = open_session
        self._session: Session | None = None
        self._thread: threading.Thread | None = None
        self._answer = ""
        self.under_way = ""
        """What is being waited for; empty if nothing is."""

    def begin(self, ask: Ask) -> bool:
        """Call a service; False if another is still being waited for."""
        if self._thread is not None:
            return False
        self.under_way = ask.value
        self._thread = threading.Thread(target=self._call, args=(ask,), daemon=True)
        self._thread.start()
        return True

    def answer(self) -> str:
        """What a service has answered, in a sentence, once; empty while there is nothing new."""
        if self._thread is None or self._thread.is_alive():
            return ""
        self._thread, self.under_way = None, ""
        return self._answer

    def close(self) -> None:
        """Let go of the connection; an answer that is still to come is not waited for."""
        if self._session is not None:
            self._session.close()

    def _call(self, ask: Ask) -> None:
        try:
            self._answer = f"{ask.value}: {self._asked(ask)}"
        except (CellwrightError, RunEndedError) as error:
            self._answer = f"{ask.value}: {error}"
        except Exception as error:  # the operator waits for an answer, and a thread that dies gives none
            self._answer = f"{ask.value}: failed: {type(error).__name__}: {error}"

    def _asked(self, ask: Ask) -> str:
        """What a service answers, in a sentence."""
        if self._session is None:
            self._session = self._open()
        self._session.adopt()  # each call has a thread of its own, one after the other
        response = self._session.call(*request(ask))
        outcome = "done" if response.success else "refused"
        return f"{outcome}; {response.message}" if response.message else outcome


def request(ask: Ask) -> tuple[str, Any]:
    """The service that is meant, and what it is asked."""
    match ask:
        case Ask.HOME:
            return HOME, TriggerRequest()
        case Ask.CLEAR_STOP:
            return CLEAR_STOP, TriggerRequest()
        case Ask.ENABLE | Ask.DISABLE:
            return ENABLE, SetBoolRequest(ask is Ask.ENABLE)
