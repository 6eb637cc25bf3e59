"""Random cells as YAML: each is refused with line and reason, or it runs equally twice and is restored equally.

With `CELLWRIGHT_RANDOM_LAYOUTS=200` there are as many cells, and each runs for 20 s of simulation time.
"""

from __future__ import annotations

import math
import os
import random
import re
import warnings
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright import Cell, load_trial
from cellwright.config.trial.trial import BeltPart, Trial
from cellwright.engine.clock import nanoseconds
from cellwright.running.run.loading import DescriptionWarning
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose

WANTED = int(os.environ.get("CELLWRIGHT_RANDOM_LAYOUTS", "0"))
COUNT, END = (WANTED, 20.0) if WANTED else (6, 2.0)
"""Number of cells, and simulation time of each run [s]."""

TYPES = ("gear_part", "piston_rod_part", "gasket_part", "disk_part", "pulley_part")
SENSORS = ("break_beam", "proximity_sensor", "laser_profiler", "logical_camera")
FAULTS: dict[str, object] = {
    "size": [0.0, -1.0],
    "at": [1e9, 0.0],
    "turn": "north",
    "surface": float("nan"),
    "colour": "green",
    "unknown": 1,
}
"""Values that are refused, by key; some sections lack the key, which is refused, too."""

_REFUSAL = re.compile(r"cell\.yaml:\d+: \S.*")

SEND = nanoseconds(0.5)
"""Time at which all trays are sent off."""


class Draw(random.Random):
    """Random values of a description."""

    def length(self, least: float, most: float) -> float:
        return round(self.uniform(least, most), 3)

    def place(self) -> list[float]:
        return [self.length(-5.0, 5.0), self.length(-5.0, 5.0)]

    def turn(self) -> float | str:
        values: list[float | str] = [0.0, "pi/2", "pi", "-pi/2", self.length(-3.2, 3.2), self.length(-3.2, 3.2)]
        return self.choice(values)

    def some(self, entry: dict[str, Any]) -> dict[str, Any]:
        """Return an entry with its place, and each of its other values in half of all cases."""
        return {key: value for key, value in entry.items() if key in ("at", "length") or self.random() < 0.5}

    def named(self, prefix: str, entry: Callable[[], dict[str, Any]], most: int) -> dict[str, Any]:
        """Return up to `most` entries, whose names end with a number."""
        return {f"{prefix}{number}": self.some(entry()) for number in range(1, self.randint(0, most) + 1)}

    def bin(self) -> dict[str, Any]:
        sides = ["+x", "-x", "+y", "-y"]
        return {
            "at": self.place(),
            "turn": self.turn(),
            "size": [self.length(0.1, 2.0), self.length(0.1, 2.0)],
            "surface": self.length(0.1, 1.5),
            "walls": self.choice([0.0, self.length(0.0, 0.3)]),
            "open": self.sample(sides, self.randint(0, 4)),
            "gap": self.length(0.0, 0.2),
        }

    def belt(self) -> dict[str, Any]:
        return {
            "at": self.place(),
            "length": self.length(0.5, 12.0),
            "turn": self.turn(),
            "width": self.length(0.2, 1.0),
            "surface": self.length(0.3, 1.2),
            "speed": self.length(0.05, 0.6),
        }

    def tray(self) -> dict[str, Any]:
        size = [self.length(0.2, 1.0), self.length(0.2, 1.0)]
        return {"at": self.place(), "turn": self.turn(), "size": size, "rim": self.length(0.0, 0.1)}

    def carrier(self) -> dict[str, Any]:
        return {"at": self.place(), "turn": self.turn(), "colour": "#3366cc"}

    def sensor(self) -> dict[str, Any]:
        xyz, rpy = [*self.place(), self.length(0.3, 2.0)], [0.0, self.length(0.0, 1.6), self.turn()]
        return {"type": self.choice(SENSORS), "pose": {"xyz": xyz, "rpy": rpy}}

    def grid(self) -> dict[str, Any]:
        """Return a few parts of one type in a bin."""
        end = [self.length(0.1, 0.6), self.length(0.1, 0.6), 0.0]
        count = {"num_models_x": self.randint(1, 2), "num_models_y": self.randint(1, 2)}
        return {"xyz_start": [0.1, 0.1, 0.0], "xyz_end": end, "rpy": [0.0, 0.0, self.turn()], **count}

    def cell(self) -> dict[str, Any]:
        """Return a cell, in a quarter of all cases with a fault."""
        cell: dict[str, Any] = {
            "frame": {"at": self.place(), "turn": self.turn()},
            "bins": self.named("bin", self.bin, 12),
            "belts": self.named("belt", self.belt, 3),
            "trays": self.named("table", self.tray, 3),
            "carriers": self.named("agv", self.carrier, 4),
        }
        if self.random() < 0.6:
            cell["arms"] = {"arm": {"mount": {"kind": "rail", "at": self.place(), "turn": self.turn()}}}
        sections = [section for section in ("bins", "belts", "trays", "carriers") if cell[section]]
        if sections and self.random() < 0.25:
            entries, key = cell[self.choice(sections)], self.choice(sorted(FAULTS))
            entries[self.choice(sorted(entries))][key] = FAULTS[key]
        return cell

    def description(self) -> dict[str, Any]:
        """Return a trial with a cell of its own."""
        cell = self.cell()
        filled = self.sample(sorted(cell["bins"]), min(3, len(cell["bins"])))
        sensors = [self.sensor() for _ in range(self.randint(0, 4))]
        ordered = [{"type": self.choice(TYPES), "pose": {"xyz": [0.1, 0.1, 0.0]}} for _ in range(2)]
        order = {
            "announcement_condition": "time",
            "announcement_condition_value": 0.0,
            "parts": {f"part_{number}": each for number, each in enumerate(ordered)},
        }
        return {
            "cell": cell,
            "options": {"insert_models_over_bins": True, "belt_population_cycles": 2},
            "sensors": {f"{each['type']}_{number}": each for number, each in enumerate(sensors)},
            "models_over_bins": {name: {"models": {self.choice(TYPES): self.grid()}} for name in filled},
            "orders": {"order_0": order},
        }


def with_riders(trial: Trial) -> Trial:
    """Return a trial with parts on each belt."""
    riders = tuple(
        BeltPart(0.3 + 0.9 * number, TYPES[(number + index) % len(TYPES)], Pose((0.0, 0.0, 0.15)), belt=belt.name)
        for index, belt in enumerate(trial.layout.belts)
        for number in range(4)
    )
    return replace(trial, belt_parts=riders)


def listened(trial: Trial) -> tuple[Cell, Counter[str]]:
    """Return a cell whose topics are all subscribed to, and the count of messages of each."""
    cell, heard = Cell(trial, competition=False), Counter[str]()

    def hear(topic: str) -> Callable[[object], None]:
        return lambda _message: heard.update((topic,))

    for topic in cell.topics():
        cell.bus.subscribe(topic, hear(topic), node="/listener")
    cell.competition.start()
    return cell, heard


def advance(cell: Cell, until: float) -> str:
    """Step a cell to a time [s], and send all trays off after half a second; return the state hash."""
    begin, end = cell.simulation.now, nanoseconds(until)
    if begin <= SEND < end:
        cell.simulation.step_until(SEND)
        for sender in cell.senders.values():
            assert sender.send("order_0_kit_0")
    cell.simulation.step_until(end)
    return cell.state_hash()


def loaded(description: dict[str, object], path: Path) -> Trial | list[str]:
    """Return a trial, or the reasons why its file is refused."""
    path.write_text(yaml.safe_dump(description))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DescriptionWarning)
            return with_riders(load_trial(path))
    except DescriptionError as error:
        return [str(each) for each in error.problems]


@pytest.mark.slow
@settings(max_examples=COUNT, deadline=None, derandomize=True, database=None, suppress_health_check=list(HealthCheck))
@given(seed=st.integers(0, 2**32), share=st.floats(0.0, 1.0))
def test_random_cell_is_refused_with_reason_or_runs_equally(
    seed: int, share: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    trial = loaded(Draw(seed).description(), tmp_path_factory.mktemp("random") / "cell.yaml")
    if isinstance(trial, list):
        assert trial
        assert all(_REFUSAL.search(problem) for problem in trial), trial
        return
    one, heard = listened(trial)
    advance(one, math.floor(share * 500 * END) / 500)
    snapshot = one.snapshot()
    whole = advance(one, END)
    other, others = listened(trial)
    assert advance(other, END) == whole
    assert heard == others
    one.restore(snapshot)
    assert advance(one, END) == whole
