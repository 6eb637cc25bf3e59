"""Policies in this process: a function of yours, or a class of a file."""

import hashlib
import time
from collections.abc import Callable, Mapping
from typing import Any

from cellwright.clients.policies.actions import ActionFormat, extras, server_time
from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack
from cellwright.clients.policies.policy import Answer, PolicyAnswerError, PolicyError
from cellwright.util import plugins
from cellwright.util.errors import MessageError, RunEndedError, SimulationError, one_line

Infer = Callable[[Mapping[str, object]], object]


class CallablePolicy:
    """A function from observations to actions, as a policy.

    The function's reply may have any form that a server's may have. Observations are those that a server gets, so what
    works here works behind a server too.

    Args:
        infer: the function.
        actions: form of the actions of its reply.
        program: object whose `reset(seed, sentence)`, `close()` and `metadata` are the policy's, as far as it has them.
        name: name in errors.

    Attributes:
        metadata: of the program; empty without one.

    Example:
        >>> policy = CallablePolicy(lambda observation: [[0.1, 0.2]])
        >>> policy.reset(1, "pick the gear")
        >>> policy.infer({"prompt": "pick the gear"}).actions
        array([[0.1, 0.2]])
    """

    def __init__(
        self,
        infer: Infer,
        *,
        actions: ActionFormat = ActionFormat(),  # noqa: B008 - frozen
        program: object = None,
        name: str = "the policy",
    ) -> None:
        self.metadata: Mapping[str, object] = getattr(program, "metadata", {})
        self._infer, self._actions, self._program, self._name = infer, actions, program, name

    def reset(self, seed: int, sentence: str) -> None:
        """Begin an episode; see `Policy.reset`."""
        if reset := getattr(self._program, "reset", None):
            self._call(reset, seed, sentence)

    def infer(self, observation: Mapping[str, object]) -> Answer:
        """Call the function; see `Policy.infer`."""
        try:
            request = pack(observation, OPENPI)
        except MessageError as error:
            raise PolicyError(f"observation: {error}") from None
        start = time.monotonic()
        reply = self._call(self._infer, observation)
        wall = time.monotonic() - start
        try:
            actions = self._actions.read(reply)
        except PolicyAnswerError as error:
            raise PolicyAnswerError(f"{self._name}: {error}") from None
        raw = pack({"actions": actions}, OPENPI)
        return Answer(actions, raw, hashlib.sha256(request).hexdigest(), wall, server_time(reply), extras(reply))

    def close(self) -> None:
        """Close the program, once."""
        program, self._program = self._program, None
        if close := getattr(program, "close", None):
            self._call(close)

    def _call(self, function: Callable[..., Any], *arguments: object) -> Any:
        try:
            return function(*arguments)
        except (SimulationError, RunEndedError, KeyboardInterrupt):  # of the run that asks
            raise
        except BaseException as error:  # a SystemExit would look like one of the agent
            called = getattr(function, "__name__", "it")
            raise PolicyAnswerError(f"{self._name}: failed in {called}: {one_line(error)}") from error


def policy_of_class(place: str, actions: ActionFormat) -> CallablePolicy:
    """Return the policy of a class path: the class is made without arguments, and has a method `infer(observation)`.

    Args:
        place: `path/to/file.py:Class`, or `package.module:Class`.
        actions: form of the actions of its replies.

    Raises:
        PolicyError: there is no such class, it has no such method, or it cannot be made.
    """
    found = plugins.find_class(place, method="infer", error=PolicyError)
    if not callable(found) or not hasattr(found, "infer"):
        raise PolicyError(f"{place}: a policy is a class with a method infer(observation)")
    program = plugins.make_factory(place, found, PolicyError)()
    return CallablePolicy(program.infer, actions=actions, program=program, name=place)
