"""Card of the benchmark, `kitting/README.md`: its tables are made from the files and results that they are about."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Final

from cellwright._package import VERSION as CELLWRIGHT
from cellwright.config.control import ControlSpace
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.task import Condition, Held, OnTray, Scored
from cellwright.util.errors import UsageError
from kitting.baselines import BASELINES
from kitting.benchmark import NAME, RATE, ROOT, TASKS, VERSION, Split, digests, seeds, seeds_file
from kitting.clone.samples import names_of
from kitting.croissant import RESULTS, croissant
from kitting.demonstrator import LONGEST_PAUSE, MISS, SLIP, SLOWEST, Style
from kitting.scores import read_outcomes, table
from kitting.submission import as_text, schema

CARD: Final = ROOT / "README.md"
SCHEMA: Final = ROOT / "submission.schema.json"
_BLOCK = re.compile(r"(<!-- made: (\w+) -->\n).*?(<!-- end -->\n)", re.DOTALL)


def tables() -> Mapping[str, Callable[[], str]]:
    """Return what makes each table of the card, by the name in its mark."""
    return {
        "identity": _identity,
        "tasks": _tasks,
        "actions": _actions,
        "observations": _observations,
        "cameras": _cameras,
        "seeds": _seeds,
        "data": _data,
        "baselines": _baselines,
        "results": _results,
        "cost": _cost,
    }


def filled(text: str) -> str:
    r"""Return the text of a card with its tables made again.

    Raises:
        KeyError: a mark names no table.

    Example:
        >>> filled("<!-- made: seeds -->\nold\n<!-- end -->\n").count("old")
        0
    """
    made = tables()
    return _BLOCK.sub(lambda block: f"{block[1]}\n{made[block[2]]()}\n{block[3]}", text)


def generated() -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each generated file."""
    yield CARD.name, filled(CARD.read_text(encoding="utf-8"))
    yield "croissant.json", json.dumps(croissant(), indent=2) + "\n"
    yield SCHEMA.name, as_text(schema())


def in_words(condition: Condition) -> str:
    """Return a condition in words.

    Example:
        >>> in_words(Held("gear_part", 0.1))
        'a gear_part is held, 0.1 m over its place'
    """
    match condition:
        case Held(part, lifted):
            return f"a {part} is held, {lifted:g} m over its place"
        case OnTray():
            turned = "" if condition.yaw is None else f" and {condition.turn_tolerance:g} rad"
            return (
                f"a {condition.part} rests on {condition.tray}, within {condition.tolerance:g} m{turned} of its place"
            )
        case Scored(points):
            return f"the submitted kits have earned {'all points' if points is None else f'{points:g} points'}"
    raise UsageError(f"card: there are no words for the condition {type(condition).__name__}; add them to in_words")


def _identity() -> str:
    described = croissant()
    facts = {
        "name, version": f"{NAME} {VERSION}, of Cellwright {CELLWRIGHT}",
        "date": described["datePublished"],
        "authors": described["creator"]["name"],
        "licence": described["license"],
        "cite as": described["citeAs"],
        "description of the data": "[croissant.json](croissant.json), Croissant 1.1 with fields of responsible AI",
        "submissions": f"[{SCHEMA.name}]({SCHEMA.name})",
    }
    return _table(("", "value"), facts.items())


def _tasks() -> str:
    rows = []
    for each in TASKS:
        limit = each.trial(Split.TEST).time_limit or 0.0
        success = "; ".join(map(in_words, each.task.success))
        rows.append(
            (f"`{each.name}`", each.task.sentence, success, each.axis, f"{limit:g} s, {limit * RATE:.0f} steps")
        )
    return _table(("task", "sentence", "success", "axis", "limit"), rows)


def _actions() -> str:
    """Return the table of the numbers of an action: all tasks have the same arm."""
    rows = [
        (str(number), f"`{each.name}`", each.unit or "on above 0.5", f"{each.low:.4g} to {each.high:.4g}")
        for number, each in enumerate(ControlSpace.of(TASKS[0].trial(Split.TEST)).channels)
    ]
    return _table(("number", "channel", "unit", "range"), rows)


def _observations() -> str:
    """Return the table of what is observed: by the names of policies, and by those of environments."""
    channels = ControlSpace.of(TASKS[0].trial(Split.TEST)).channels
    state = {len(names_of(each.trial(Split.TEST))) - len(channels) for each in TASKS}
    rows = [
        (
            "`state`",
            "`agent_pos`",
            f"float32 ({len(channels)},)",
            "measured value of each channel, as in the table above",
        ),
        ("`images.NAME`", "`pixels.NAME`", "uint8 (H, W, 3)", "newest picture of a camera, red first, upright"),
        ("`prompt`", "`task_description`", "text", "the sentence of the task"),
        (
            "none",
            "`environment_state`",
            f"float32, {min(state)} to {max(state)} numbers",
            "**privileged**: poses of tool, parts and goals, speeds of belts",
        ),
    ]
    return _table(("policy", "environment", "type", "content"), rows)


def _cameras() -> str:
    trials = [each.trial(Split.TEST) for each in TASKS]
    found = [each for trial in trials for each in trial.sensors if isinstance(each, PictureCameraConfig)]
    rows = {
        (f"`{each.name}`", f"{each.width} × {each.height}", f"{each.fov:g} rad", f"{each.rate:g} Hz", f"`{each.frame}`")
        for each in found
    }
    return _table(("camera", "pixels", "horizontal field", "rate", "mounted on"), sorted(rows))


def _seeds() -> str:
    rows = []
    for split in Split:
        found, name = seeds(split), seeds_file(split).name
        span = f"{len(found)}: {found[0]} to {found[-1]}"
        rows.append((str(split), span, f"[{name}](seeds/{name})", f"`{digests()[name]}`"))
    return _table(("split", "seeds", "file", "SHA-256"), rows)


def _data() -> str:
    styles = [Style.draw(seed) for seed in seeds(Split.TRAIN)]
    count = len(styles)
    missed, slipped = sum(each.misses > 0 for each in styles), sum(any(each.slip) for each in styles)
    facts = {
        "demonstrations": f"{count} of each task, {len(TASKS) * count} in all; failures are kept and marked",
        "made by": "`python -m kitting demonstrate`: the bundled agent, in a style drawn by the seed",
        "pace": f"durations of motions times 1 to {SLOWEST:g}",
        "hesitation": f"up to {LONGEST_PAUSE:g} s before a part is grasped or laid down",
        "grasp in vain": f"{missed} of {count} styles, of a part at rest: the cup closes {MISS * 1000:g} mm above it",
        "part laid beside its place": f"{slipped} of {count} styles, by {SLIP * 1000:g} mm, and corrected",
        "format": f"recordings (MCAP); `cellwright export` makes a LeRobotDataset v3.0 of them, {RATE} frames a second",
    }
    return _table(("", "value"), facts.items())


def _baselines() -> str:
    rows = [(f"`{name}`", each.about, each.sees) for name, each in BASELINES.items()]
    return _table(("program", "about", "sees"), rows)


def _results() -> str:
    return table(read_outcomes(RESULTS))


def _cost() -> str:
    rows = [
        (f"`{name}`", f"{sum(each.wall for each in records) / 3600.0:.1f}")
        for name, records in read_outcomes(RESULTS).items()
    ]
    return _table(("program", "core hours"), rows)


def _table(head: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = tuple(head)
    return "".join(f"| {' | '.join(row)} |\n" for row in (head, ("---",) * len(head), *rows))
