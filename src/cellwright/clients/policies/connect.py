"""Policies by their addresses."""

from collections.abc import Mapping
from typing import Final

from cellwright.clients.policies.act import ActPolicy
from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.baselines import Hold, Random
from cellwright.clients.policies.callable_policy import CallablePolicy, policy_of_class
from cellwright.clients.policies.openpi import OpenpiPolicy
from cellwright.clients.policies.policy import Policy, PolicyError
from cellwright.clients.policies.server_policy import ServerPolicy
from cellwright.clients.policies.sockets import TIMEOUT
from cellwright.config.control import ControlSpace
from cellwright.util import plugins
from cellwright.util.errors import did_you_mean

BASELINES: Final[Mapping[str, type[Hold | Random]]] = {"hold": Hold, "random": Random}
"""Bundled policies by name."""
_GROOT: Final = "tcp"
_WIRES: Final[Mapping[str, type[ServerPolicy]]] = {
    "ws": OpenpiPolicy,
    "wss": OpenpiPolicy,
    "http": ActPolicy,
    "https": ActPolicy,
}
SCHEMES: Final = (*_WIRES, _GROOT)
"""Schemes of addresses of policy servers."""
_FORMS: Final = "ws://HOST:PORT, http://HOST:PORT/act, tcp://HOST:PORT, path.py:Class, hold or random"


def connect(
    address: str,
    *,
    dialect: str | None = None,
    timeout: float = TIMEOUT,
    actions: ActionFormat = ActionFormat(),  # noqa: B008 - frozen
    space: ControlSpace | None = None,
) -> Policy:
    """Return the policy at an address; close it at the end.

    Args:
        address: of a server: `ws://HOST:PORT` or `wss://…` (OpenPI's websocket), `http://HOST:PORT/act` or `https://…`
            (OpenVLA and its kin), or `tcp://HOST:PORT` (GR00T, with the extra `groot`). Or a class in this process,
            `path.py:Class` or `module:Class`; or a bundled policy, `hold` or `random`.
        dialect: dialect of the server; None for the usual one, or to tell it from a websocket's first frame.
        timeout: bound of an answer [s].
        actions: form that the actions of an answer must have.
        space: channels of the cell, which the bundled policies need.

    Raises:
        PolicyError: no such policy or dialect, or an address that is none.
        PolicyConnectionError: the server cannot be reached.
        PolicyAnswerError: another kind of server answers.

    Example:
        >>> from cellwright import load_trial
        >>> policy = connect("random", space=ControlSpace.of(load_trial("lesson")))
        >>> policy.reset(1, "")
        >>> policy.infer({}).actions.shape
        (1, 8)
        >>> connect("localhost:8000")
        Traceback (most recent call last):
        cellwright.clients.policies.policy.PolicyError: localhost:8000: an address begins with its scheme; write ws://localhost:8000
    """
    if not timeout > 0.0:
        raise PolicyError(f"timeout: must be above 0 s (got {timeout:g})")
    if "://" in address:
        scheme = address.partition("://")[0].lower()
        if scheme not in SCHEMES:
            raise PolicyError(f"{address}: no scheme of a policy server; a policy is {_FORMS}")
        wire = _groot_wire(address) if scheme == _GROOT else _WIRES[scheme]
        return wire(address, dialect=dialect, timeout=timeout, actions=actions)
    if dialect is not None:
        raise PolicyError(f"dialect: only a server has one (got {dialect!r} for {address})")
    if address in BASELINES:
        if space is None:
            raise PolicyError(f"{address}: this policy needs the channels of a cell; give space")
        program = BASELINES[address](space)
        return CallablePolicy(program.infer, actions=actions, program=program, name=address)
    if address.rpartition(":")[2].isdigit():
        raise PolicyError(f"{address}: an address begins with its scheme; write ws://{address}")
    if not plugins.is_class_path(address):
        raise PolicyError(f"unknown policy {address!r}{did_you_mean(address, BASELINES)}; a policy is {_FORMS}")
    return policy_of_class(address, actions)


def _groot_wire(address: str) -> type[ServerPolicy]:
    if not plugins.is_installed("zmq"):
        raise PolicyError(f"{address}: needs the package pyzmq; pip install 'cellwright[groot]'")
    from cellwright.clients.policies.groot import GrootPolicy

    return GrootPolicy
