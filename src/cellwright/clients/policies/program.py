"""Agents of policies by the words of a command line, and their check against a trial before anything starts."""

from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import urlsplit

from cellwright.clients.policies.actions import ActionFormat
from cellwright.clients.policies.agent import PolicyAgent, Setting
from cellwright.clients.policies.cell_workplace import cell_names
from cellwright.clients.policies.connect import BASELINES, SCHEMES, connect
from cellwright.clients.policies.dialects import GROOT_MODALITIES
from cellwright.clients.policies.key_map import RATE, Cell
from cellwright.clients.policies.map_reader import load_map
from cellwright.clients.policies.policy import Policy, PolicyConnectionError, PolicyError
from cellwright.clients.policies.presets import map_path
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.spec import MAP, PolicySpec
from cellwright.config.control import period_ticks
from cellwright.config.trial.trial import Trial
from cellwright.util import plugins
from cellwright.util.errors import UsageError

_GROOT = "tcp://"


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
        UsageError: the cell has nothing to command, a control period would be no whole number of its ticks, or the
            policy is one of GR00T's and gets other names than it knows.
    """
    cell = cell_names(trial)
    if not cell.space.channels:
        raise UsageError(f"{trial.name}: there is no arm and no robot for a policy to command; add one to its cell")
    check_map(words, cell)


def check_map(words: str, cell: Cell) -> None:
    """Check that the map of a policy fits a cell or a robot's node, by its names; errors as of `check_policy`."""
    spec = PolicySpec.read(words)
    if spec.map:
        key_map = load_map(map_path(spec.map), cell)
        if spec.policy.startswith(_GROOT):
            _check_names(spec, key_map.observation)
    elif spec.policy.startswith(_GROOT):
        raise UsageError(f"{spec.policy}: its policies have names of their own for what they see; add {MAP}")
    else:
        period_ticks(RATE, cell.timestep)


def _check_names(spec: PolicySpec, names: Iterable[str]) -> None:
    """Refuse names that no policy of GR00T can have."""
    for name in names:
        if name.partition(".")[0] not in GROOT_MODALITIES:
            raise UsageError(
                f"{spec.map}: observation: a name for {spec.policy} begins with {', '.join(GROOT_MODALITIES)} "
                f"(got {name}); write {GROOT_MODALITIES[1]}.{name}"
            )


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
