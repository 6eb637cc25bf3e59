"""Sweep of an evaluation: each trial with several values of a key of its configuration.

Several swept keys give all combinations of their values. Each combination is a trial of its own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import prod

from cellwright.config.parsing.overrides import Override, read_values
from cellwright.config.trial.trial import Trial
from cellwright.util.errors import UsageError

OPTION = "--sweep"
MAX_VARIANTS = 1000
"""Maximum number of combinations of values."""

SEED = "cellwright.seed"
_WITHOUT_EFFECT = ("gazebo_state_logging", "disable_shadows", "unthrottled_physics_update")


@dataclass(frozen=True, slots=True)
class Sweep:
    """Key of the configuration, with its values as YAML texts.

    Example:
        >>> Sweep.read("orders.order_0.kit_count=1, 2, 3").values
        ('1', '2', '3')
        >>> Sweep.read("cellwright.arm.gains={}, {elbow_joint: {p: 1, d: 1}}").values
        ('{}', '{elbow_joint: {p: 1, d: 1}}')
    """

    key: str
    values: tuple[str, ...]

    @classmethod
    def read(cls, text: str) -> Sweep:
        """Read `KEY=A,B,C`.

        Raises:
            UsageError: it is not of this form, or a value comes twice.
        """
        key, separator, listed = (each.strip() for each in text.partition("="))
        if not key or not separator or not text.isprintable():
            raise UsageError(f"{OPTION}: must be KEY=A,B,C (got {text!r:.60}); write it as in time_limit=60,120")
        values = read_values(f"{OPTION} {key}", listed)
        if not values:
            raise UsageError(f"{OPTION} {key}: no value given; write it as in time_limit=60,120")
        if twice := [value for number, value in enumerate(values) if value in values[:number]]:
            raise UsageError(f"{OPTION} {key}: {twice[0]} is given twice; leave one out")
        return cls(key, tuple(values))


def variants(sweeps: Sequence[Sweep], trial: str = "") -> list[tuple[Override, ...]]:
    """Return all combinations of the values, those of the last key fastest; a single empty one without a sweep.

    Args:
        sweeps: the swept keys.
        trial: the trial that errors about the values name; empty for none.

    Raises:
        UsageError: two sweeps have one key, or there are too many combinations.
    """
    keys = [sweep.key for sweep in sweeps]
    if twice := [key for key in keys if keys.count(key) > 1]:
        raise UsageError(f"{OPTION} {twice[0]}: the key is given twice; list its values in one {OPTION}")
    if (count := prod(len(sweep.values) for sweep in sweeps)) > MAX_VARIANTS:
        raise UsageError(f"{OPTION}: at most {MAX_VARIANTS} combinations (got {count}); give fewer values")
    option = f"{trial}: {OPTION}" if trial else OPTION
    lists = ([Override(sweep.key, value, option) for value in sweep.values] for sweep in sweeps)
    return list(product(*lists))


def _compared(trial: Trial) -> Trial:
    """Return a trial without what makes no difference to a run of an evaluation, which has a seed of its own."""
    options = replace(trial.options, **dict.fromkeys(_WITHOUT_EFFECT, False))
    return replace(trial, options=options, settings=replace(trial.settings, seed=0))


def check_effect(sweeps: Sequence[Sweep], trials: Sequence[Trial]) -> None:
    """Refuse a key whose values make no difference, whatever those of the other keys.

    Args:
        sweeps: the swept keys.
        trials: a trial with each of the `variants`, in their order.

    Raises:
        UsageError: a key has no effect.
    """
    if any(sweep.key == SEED for sweep in sweeps):
        raise UsageError(f"{OPTION} {SEED}: each run of an evaluation has a seed of its own; use --seeds")
    combinations = list(product(*(sweep.values for sweep in sweeps)))
    compared = list(map(_compared, trials))
    for number, sweep in enumerate(sweeps):
        first: dict[tuple[str, ...], Trial] = {}
        # A key has no effect if all trials that differ in it alone are equal.
        others = [(*values[:number], *values[number + 1 :]) for values in combinations]
        if len(sweep.values) > 1 and all(
            first.setdefault(other, trial) == trial for other, trial in zip(others, compared, strict=True)
        ):
            values = " and ".join(sweep.values[:2])
            raise UsageError(
                f"{OPTION} {sweep.key}: {values} make the same trial {trials[0].name}; sweep a key that it uses"
            )


def variant_name(trial: str, overrides: Iterable[object]) -> str:
    """Return the name of a trial with its overrides, such as `lesson time_limit=60`."""
    return " ".join([trial, *map(str, overrides)])
