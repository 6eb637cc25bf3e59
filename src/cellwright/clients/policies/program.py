"""Agents of policies by the words of a command line, and their check against a trial before anything starts."""

from collections.abc import Callable
from pathlib import Path
from urllib.parse import urlsplit

from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.agent import PolicyAgent, Setting
from cellwright.clients.policies.baselines import BASELINES
from cellwright.clients.policies.connect import connect
from cellwright.clients.policies.key_map import RATE, Cell
from cellwright.clients.policies.map_reader import load_map
from cellwright.clients.policies.policy import Policy, PolicyConnectionError, PolicyError
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.spec import PolicySpec
from cellwright.config.control import ControlSpace, period_ticks
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.trial import Trial
from cellwright.util import plugins
from cellwright.util.errors import UsageError

SCHEMES = ("ws", "wss", "http", "https", "tcp")
"""Schemes of addresses of policy servers."""


def policy_agent(words: str) -> Callable[[], PolicyAgent]:
    """Return a factory of agents for a policy, by its words; each agent makes a policy of its own, in its run.

    Raises:
        UsageError: the words are none of a policy, or the file of a recorded episode cannot be read.
        PolicyError: there is no such policy.
    """
    spec = PolicySpec.read(words)
    if not spec.is_recorded:
        _check_name(spec.policy)
        return lambda: PolicyAgent(spec, lambda setting: _made(spec, setting))
    recorded = RecordedPolicy.read(Path(spec.policy))
    return lambda: PolicyAgent(spec, lambda _setting: recorded, recorded.rules)


def check_policy(words: str, trial: Trial) -> None:
    """Check that a policy fits a trial, without asking it.

    Raises:
        DescriptionError: its map cannot be read, or names what the cell does not have.
        UsageError: the cell has nothing to command, or a control period would be no whole number of its ticks.
    """
    spec = PolicySpec.read(words)
    space, timestep = ControlSpace.of(trial), trial.settings.timestep
    if not space.channels:
        raise UsageError(f"{trial.name}: there is no arm and no robot for a policy to command; add one to its cell")
    if spec.map:
        cameras = [each.name for each in trial.sensors if isinstance(each, PictureCameraConfig) and each.has_colour]
        load_map(Path(spec.map), Cell(space, cameras, [arm.name for arm in trial.arms], timestep))
    else:
        period_ticks(RATE, timestep)


def _made(spec: PolicySpec, setting: Setting) -> Policy:
    form = ActionFormat(dimension=setting.key_map.size)
    dialect = setting.key_map.dialect or None
    try:
        return connect(spec.policy, dialect=dialect, actions=form, space=setting.cell.space)
    except PolicyError as error:
        # an unknown dialect, say: like a server that is not there, it tells nothing of the policy
        raise PolicyConnectionError(str(error)) from None


def _check_name(name: str) -> None:
    """Refuse a name that is no policy, before anything runs; a class of a file is imported, and not made."""
    if "://" in name:
        if urlsplit(name).scheme not in SCHEMES:
            raise PolicyError(f"{name}: no scheme of a policy server; an address is ws://HOST:PORT")
    elif name not in BASELINES:
        if not plugins.is_class_path(name) or name.rpartition(":")[2].isdigit():
            connect(name)  # it says what is wrong
        plugins.find_class(name, method="infer", error=PolicyError)
