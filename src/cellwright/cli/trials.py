"""Command `cellwright trials`: the bundled trials."""

import json
import math
from collections import Counter
from collections.abc import Iterable
from typing import Annotated, Any

import typer
from rich.console import Console

from cellwright.cell.checks.difficulty import difficulties
from cellwright.cell.kitting.attainable import attainable_score
from cellwright.cell.kitting.scorer import system_cost
from cellwright.cli import output
from cellwright.cli.parameters import flag
from cellwright.cli.tables import FOLD, RIGHT, print_table, table
from cellwright.config.trial.catalogue import all_bundled, bundled, bundled_sensors, bundled_tasks, find_trial, scenario
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.trial import Order, Trial
from cellwright.util import plugins as plugins
from cellwright.util.errors import CellwrightError

_NAME_WIDTH = max(map(len, (*bundled(), *bundled_tasks())))


def trials(as_json: Annotated[bool, flag("--json", "Print the list as JSON.")] = False) -> None:
    """List the bundled trials: the task or the orders of each, and its difficulties.

    The finals and most others have no arm and no sensors, as in the competition, where each team brought its own. Add a
    file that has them; the bundled ones are at the end of the list.

        cellwright run final01+kitter_sensors
    """
    listed_trials = {name: _load(name) for name in (*bundled(), *bundled_tasks())} | _plugin_trials()
    sensors = {name: _load(name) for name in bundled_sensors()}
    if as_json:
        document = {
            "trials": [_trial(name, trial) for name, trial in listed_trials.items()],
            "sensors": [_sensors(name, trial) for name, trial in sensors.items()],
        }
        typer.echo(json.dumps(document, indent=2))
    else:
        _show(listed_trials, sensors)


def _plugin_trials() -> dict[str, Trial]:
    """Return the trials of other packages; of an invalid one only the package is reported."""
    loaded = {}
    for name in plugins.names("trials"):
        try:
            if name in all_bundled():
                raise plugins.plugin_error("trials", name, "has the name of a bundled trial")
            loaded[name] = _load(name)
        except CellwrightError as error:
            output.warn(error)
    return loaded


def _heading(name: str) -> str:
    """Return the heading of a trial in the list."""
    return scenario(name) if name in all_bundled() else f"of the package {plugins.package('trials', name)}"


def _load(name: str) -> Trial:
    return load_trial([find_trial(name)]).trial


def _show(listed_trials: dict[str, Trial], sensors: dict[str, Trial]) -> None:
    console = Console(highlight=False)
    headings = {name: _heading(name) for name in listed_trials}
    for heading in dict.fromkeys(headings.values()):
        names = [name for name in listed_trials if headings[name] == heading]
        columns = {"trial": {**FOLD, "min_width": _NAME_WIDTH}, "limit": RIGHT, "orders; - difficulties": FOLD}
        rows = [(name, _limit(listed_trials[name]), "\n".join(_lines(listed_trials[name]))) for name in names]
        output.print_line(console, heading, "bold")
        print_table(console, table(columns, rows, box=None, padding=(0, 2, 0, 0)))
        console.print()
    for name, trial in sensors.items():
        counts = Counter(sensor.type for sensor in trial.sensors)
        listed = ", ".join(f"{count} {kind}" for kind, count in counts.items())
        arm = "an arm, " if trial.has_arm else ""
        output.print_line(console, f"{name}: {arm}{listed}; ${system_cost(trial.sensors):g}")


def _limit(trial: Trial) -> str:
    return "none" if trial.time_limit is None else f"{trial.time_limit:g} s"


def _lines(trial: Trial) -> Iterable[str]:
    """Return the lines of a trial: its task, its orders, a line each, and its difficulties."""
    if trial.task is not None:
        yield trial.task.sentence
    for order in trial.orders:
        parts = ", ".join(f"{count} {part_type}" for part_type, count in _parts(order).items())
        yield f"{len(order.kits)} x ({parts})" if len(order.kits) > 1 else parts
    yield from (f"- {demand.text}" for demand in difficulties(trial))


def _parts(order: Order) -> Counter[str]:
    """Return the number of parts of each type in one kit of an order."""
    return Counter(each.type for each in order.kits[0].objects) if order.kits else Counter()


def _trial(name: str, trial: Trial) -> dict[str, Any]:
    attainable = attainable_score(trial)
    return {
        "name": name,
        "scenario": _heading(name),
        "file": str(find_trial(name)),
        "time_limit": trial.time_limit,
        "task": None if trial.task is None else trial.task.sentence,
        "has_arm": trial.has_arm,
        "sensor_cost": system_cost(trial.sensors),
        "points": attainable.maximum,
        "reachable": attainable.total,
        "orders": [_order(order) for order in trial.orders],
        "demands": [{"kind": demand.kind, "text": demand.text} for demand in difficulties(trial)],
    }


def _order(order: Order) -> dict[str, Any]:
    start = order.start_time
    return {
        "order_id": order.order_id,
        "start_time": start if start is not None and math.isfinite(start) else None,
        "wanted_parts": order.wanted_parts,
        "unwanted_parts": order.unwanted_parts,
        "kits": len(order.kits),
        "parts": dict(_parts(order)),
    }


def _sensors(name: str, trial: Trial) -> dict[str, Any]:
    return {
        "name": name,
        "file": str(find_trial(name)),
        "has_arm": trial.has_arm,
        "sensor_cost": system_cost(trial.sensors),
        "sensors": {sensor.name: sensor.type for sensor in trial.sensors},
    }
