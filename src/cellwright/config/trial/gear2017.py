"""Loads configurations in the format of the 2017 kit-building competition, with Cellwright's own section beside it.

The way: texts joined -> YAML with places -> figures in the original's terms -> a `Trial`. What the original read is
read as it read it, with a warning for all that it passed over in silence; what it refused, and what means nothing, is
refused with everything that is wrong at once.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cellwright.config.layout import PART_TYPES, REFERENCE_FRAMES, TRAY_FRAMES
from cellwright.config.models.section import read_own_models
from cellwright.config.parsing import evaluated
from cellwright.config.parsing.figures import BeltFigure, DropFigure, Figures, ModelFigure, OrderFigure
from cellwright.config.parsing.problems import Place, Problem, Problems
from cellwright.config.parsing.python2 import dictionary_order
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.texts import JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Leaf, Node, Table, described
from cellwright.config.parsing.yaml_source import parse
from cellwright.config.trial import keys
from cellwright.config.trial.belt import read_belt
from cellwright.config.trial.cameras import read_cameras
from cellwright.config.trial.faults import check_faulty, read_drops, read_faulty
from cellwright.config.trial.models import PartBook, read_bins, read_extras
from cellwright.config.trial.options import OptionFigures, read_options
from cellwright.config.trial.orders import read_orders
from cellwright.config.trial.other_years import OtherYear
from cellwright.config.trial.plugin_devices import read_plugin_devices
from cellwright.config.trial.sensors import read_arm, read_sensors
from cellwright.config.trial.settings import SettingFigures, read_settings
from cellwright.config.trial.trial import Sensor, Trial
from cellwright.config.trial.trial_of import trial_of
from cellwright.util.errors import DescriptionError, UsageError

TOP_LEVEL = keys.SECTIONS.names
"""The sections of the 2017 format."""

OWN = "cellwright"
"""The section that Cellwright adds."""

DEFAULT_TIME_LIMIT = 500


@dataclass(frozen=True, slots=True)
class Loaded:
    """A trial, what the original's launcher would have made of its files, and what their author should know."""

    trial: Trial
    figures: Figures
    warnings: tuple[Problem, ...]


def load_trial(paths: Sequence[Path] = (), *, text: str | None = None) -> Loaded:
    """Load a trial from files, whose texts are joined in the order given, or from a text.

    Args:
        paths: the files; the trial is named after the first.
        text: the configuration itself, instead of files.

    Raises:
        DescriptionError: the configuration cannot be used; the error lists everything that was found wrong.
        UsageError: neither files nor a text, or both.
    """
    if bool(paths) == (text is not None):
        raise UsageError("a trial is loaded from files or from a text")
    joined = read_texts(paths) if text is None else JoinedText([Text("<text>", text)])
    problems = Problems()
    root = _top(parse(joined, problems), joined)
    trial, figures = _read(root, paths[0].stem if paths else "text", Reader(problems))
    return Loaded(trial, figures, problems.warnings)


def _top(root: Node | None, joined: JoinedText) -> Table:
    """The top level as a mapping; nothing at all is an empty one."""
    if root is None or (isinstance(root, Leaf) and root.value is None):
        return Table(Place(0, "", 0), "")
    if isinstance(root, Table):
        return root
    message = f"a configuration is a mapping of sections, not {described(root)}{joined.glue_hint(root.place)}"
    raise DescriptionError([Problem(root.place, "", message)])


def _read(root: Table, name: str, reader: Reader) -> tuple[Trial, Figures]:
    """Read all sections, and go on to what they come to only if no error was found."""
    evaluated.check(root, reader.problems)
    other_year = OtherYear(root)
    for entry in root.entries.values():
        if entry.name not in TOP_LEVEL and entry.name != OWN:
            reader.problems.error(entry, other_year.top_level(entry.name, (*TOP_LEVEL, OWN)))

    node = root.get("options")
    options = read_options(node, reader) if node else OptionFigures()
    models = read_own_models(root.get(OWN), reader)
    devices = read_plugin_devices(root.get(OWN), reader)
    book = PartBook(reader, options, PART_TYPES | models.parts.keys())
    bins, extras = _models(root, book)
    node = root.get("belt_parts")
    belt = read_belt(node, book, other_year) if node else ()
    node = root.get("drops")
    drops = read_drops(node, book) if node else ()
    node = root.get("orders")
    orders = read_orders(node, book, other_year) if node else ()
    node = root.get("faulty_parts")
    faulty = read_faulty(node, reader) if node else {}
    node = root.get("time_limit")
    time_limit = reader.number(node) if node else DEFAULT_TIME_LIMIT
    node = root.get("arm")
    has_arm = read_arm(node, reader) if node else False
    node = root.get("sensors")
    sensors: tuple[Sensor, ...] = read_sensors(node, reader) if node else ()
    sensors += read_cameras(root.get(OWN), sensors, reader, has_arm=has_arm)
    node = root.get(OWN)
    own = read_settings(node, reader) if node else SettingFigures()
    if reader.problems.errors:
        raise DescriptionError(reader.problems.errors, reader.problems.warnings)

    figures = _figures(book, bins, extras, belt, tuple(faulty), drops, orders, time_limit)
    check_faulty(faulty, figures, options.options, reader)
    _warn_unused(root, options, orders, reader)
    return trial_of(name, figures, options.options, sensors, own, models, devices, has_arm=has_arm), figures


def _models(root: Table, book: PartBook) -> tuple[tuple[ModelFigure, ...], tuple[ModelFigure, ...]]:
    """The parts over the bins and the extra ones; whose numbers come first follows from the original's walk."""
    bins: tuple[ModelFigure, ...] = ()
    extras: tuple[ModelFigure, ...] = ()
    for name in dictionary_order(name for name in root.entries if name != OWN):
        node = root.get(str(name))
        if name == "models_over_bins" and node:
            bins = read_bins(node, book)
        elif name == "models_to_spawn" and node:
            extras = read_extras(node, book)
    return bins, extras


def _figures(
    book: PartBook,
    bins: Sequence[ModelFigure],
    extras: Sequence[ModelFigure],
    belt: Sequence[BeltFigure],
    faulty: tuple[str, ...],
    drops: tuple[DropFigure, ...],
    orders: tuple[OrderFigure, ...],
    time_limit: float | None,
) -> Figures:
    """What comes into the cell: what the options switch on and what there is a model for."""
    switches = book.options.options
    frames = set(REFERENCE_FRAMES) - (set() if switches.insert_agvs else set(TRAY_FRAMES))
    inserted = bins if switches.insert_models_over_bins else ()
    spawned = [part for part in extras if part.origin in frames] if switches.spawn_extra_models else []
    return Figures(
        time_limit=DEFAULT_TIME_LIMIT if time_limit is None else time_limit,
        models=tuple(part for part in inserted if part.type in book.types),
        extra_models=tuple(part for part in spawned if part.type in book.types),
        belt=tuple(part for part in belt if part.type in book.types),
        faulty=faulty,
        drops=drops,
        orders=orders,
        material_locations=_locations(bins, belt),
    )


def _locations(bins: Iterable[ModelFigure], belt: Iterable[BeltFigure]) -> dict[str, frozenset[str]]:
    """Where each type can be found. The bins count even when their parts are not inserted."""
    places: dict[str, set[str]] = {"tray": {"agv1_load_point", "agv2_load_point"}}
    for part in belt:
        places.setdefault(part.type, set()).add("belt")
    for model in bins:
        places.setdefault(model.type, set()).add(model.origin)
    return {part_type: frozenset(units) for part_type, units in places.items()}


def _warn_unused(root: Table, options: OptionFigures, orders: Sequence[OrderFigure], reader: Reader) -> None:
    """Warn of sections that an option leaves without effect."""
    switches = options.options
    gates = (
        ("models_over_bins", switches.insert_models_over_bins, "insert_models_over_bins is true"),
        ("models_to_spawn", switches.spawn_extra_models, "spawn_extra_models is true"),
        ("belt_parts", switches.belt_population_cycles > 0, "belt_population_cycles is above 0"),
    )
    for name, is_used, condition in gates:
        entry = root.entries.get(name)
        is_empty = entry is None or (isinstance(entry.value, Table) and not entry.value.entries)
        if entry and not is_empty and not is_used:
            reader.problems.warn(entry, f"nothing of it comes into the cell unless options.{condition}")
    node = root.get("options")
    if node and switches.fill_demo_tray and not (orders and switches.insert_agvs):
        missing = "no tray" if orders else "no order"
        reader.problems.warn(node, f"fill_demo_tray has no effect, for there is {missing}")
