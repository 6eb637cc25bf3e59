"""Pytest plugin: cells, runs and recordings as fixtures, chosen by the markers `trial` and `seeds`.

Pytest loads it through its entry point. Cellwright does not depend on pytest, and this module loads nothing else of
Cellwright until a test needs a run.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, cast, get_args

import pytest

if TYPE_CHECKING:
    from cellwright.cell.cell import Cell
    from cellwright.clients.agents.agent import Agent
    from cellwright.config.trial.joining import TrialName
    from cellwright.config.trial.trial import Trial
    from cellwright.recording.opened import Recording
    from cellwright.running.run import RunResult
    from cellwright.running.run.headless import CellOfTrial

_TRIAL = (
    "trial(trial, agent=None, until=None, vary=False, set=(), files=(), servo=None): trial of the fixtures cell, run "
    "and recording: its name, path, object or a list of files to join. agent works in a run: a class or a name. until: "
    "simulation time [s] at which a run stops. vary: the seed varies the cell. set: values that replace those of the "
    "files, as KEY=VALUE. files: more files to join, such as one with sensors. servo: servo profile of the arm."
)
_SEEDS = "seeds(*seeds): repeats the test with each seed of the trial."
_FILE = pytest.StashKey[Path]()


def pytest_configure(config: pytest.Config) -> None:
    """Declare the markers."""
    config.addinivalue_line("markers", _TRIAL)
    config.addinivalue_line("markers", _SEEDS)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Repeat a test for the seeds of its marker."""
    seeds = metafunc.definition.get_closest_marker("seeds")
    if seeds is None:
        return
    if "trial_seed" not in metafunc.fixturenames:
        raise pytest.UsageError(
            f"{metafunc.definition.nodeid}: seeds has no effect; let the test use cell, run or recording"
        )
    if not seeds.args or not all(type(seed) is int for seed in seeds.args):
        raise pytest.UsageError(
            f"{metafunc.definition.nodeid}: seeds must be whole numbers (got {seeds.args}); write seeds(1, 2, 3)"
        )
    metafunc.parametrize("trial_seed", seeds.args, indirect=True)


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Name the recording of a failed test in its report."""
    made: Any = yield
    report: pytest.TestReport = made.get_result()
    if report.failed and (path := item.stash.get(_FILE, None)) is not None:
        report.sections.append(("Cellwright recording", f"{path}\ncellwright replay {path} --view"))


class _Request(NamedTuple):
    """Run that a test needs; equal requests share one run."""

    trial: Trial | tuple[str | Path, ...]
    agent: Agent | type[Agent] | str | None = None
    until: float | None = None
    vary: bool = False
    overrides: tuple[str, ...] = ()
    servo: Any = None
    seed: int | None = None

    @property
    def key(self) -> tuple[object, ...]:
        """Value that is equal for equal runs; objects are equal to themselves alone."""
        return *(value if isinstance(value, str | tuple) else id(value) for value in self[:2]), *self[2:]

    @property
    def name(self) -> str:
        """Name of the trial for people."""
        return "+".join(map(str, self.trial)) if isinstance(self.trial, tuple) else self.trial.name

    @property
    def cell(self) -> CellOfTrial:
        """The cell of the trial."""
        from cellwright.running.run.headless import CellOfTrial

        return CellOfTrial(self.trial, self.seed, self.vary, self.overrides, self.servo)


class _Runs:
    """Runs of a session of pytest, each made once."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._results: dict[tuple[object, ...], RunResult] = {}

    def result(self, request: _Request) -> RunResult:
        """Return the result of a run; its recording is the first of its `recordings`."""
        if request.key not in self._results:
            self._results[request.key] = self._run(request)
        return self._results[request.key]

    def _run(self, request: _Request) -> RunResult:
        from cellwright.running.run import RunOptions

        path = self._folder / f"run_{len(self._results) + 1}.mcap"
        return request.cell.run(request.agent, path, RunOptions(until=request.until))


@pytest.fixture(scope="session")
def cellwright_runs(tmp_path_factory: pytest.TempPathFactory) -> _Runs:
    """Runs that tests share."""
    return _Runs(tmp_path_factory.mktemp("cellwright"))


@pytest.fixture
def trial_seed(request: pytest.FixtureRequest) -> int | None:
    """Seed of the test, from the marker `seeds`; None takes the trial's own."""
    return getattr(request, "param", None)


@pytest.fixture
def cell(request: pytest.FixtureRequest, trial_seed: int | None) -> Iterator[Cell]:
    """A new cell of the marked trial, at time 0; the agent of the marker does not work in it."""
    made = _requested(request, trial_seed).cell.make(_warn)
    with closing(made.simulation):
        yield made


@pytest.fixture
def run(request: pytest.FixtureRequest, cellwright_runs: _Runs, trial_seed: int | None) -> RunResult:
    """Result of a run of the marked trial, as of `cellwright.run_trial`. Tests with equal markers share it."""
    return _finished(request, cellwright_runs, trial_seed)


@pytest.fixture
def recording(request: pytest.FixtureRequest, cellwright_runs: _Runs, trial_seed: int | None) -> Iterator[Recording]:
    """Open recording of a run of the marked trial. Tests with equal markers share the run."""
    from cellwright.recording.opened import Recording

    result = _finished(request, cellwright_runs, trial_seed)
    with Recording(result.recordings[0]) as opened:
        yield opened


def _finished(request: pytest.FixtureRequest, runs: _Runs, seed: int | None) -> RunResult:
    """Return the result of the requested run; a run that is no base for assertions fails the test."""
    from cellwright.running.run import Outcome
    from cellwright.util.errors import CellwrightError

    wanted = _requested(request, seed)
    try:
        result = runs.result(wanted)
    except CellwrightError as error:
        pytest.fail(f"trial {wanted.name}: {error}", pytrace=False)
    request.node.stash[_FILE] = result.recordings[0]
    if result.outcome in (Outcome.CRASHED, Outcome.INFRASTRUCTURE, Outcome.UNSTABLE):
        pytest.fail(f"trial {wanted.name}: {result.outcome} at {result.simulated:g} s\n{result.error}", pytrace=False)
    if not result.is_recorded:
        pytest.fail(f"trial {wanted.name}: the recording is incomplete; free space on the disk", pytrace=False)
    return result


def _requested(request: pytest.FixtureRequest, seed: int | None) -> _Request:
    """Return the run that the marker `trial` of a test describes."""
    marker = request.node.get_closest_marker("trial")
    if marker is None:
        pytest.fail(f"{request.node.name}: no trial is chosen; mark it, as @pytest.mark.trial('lesson')", pytrace=False)
    try:
        return _described(*marker.args, **marker.kwargs)._replace(seed=seed)
    except TypeError as error:
        pytest.fail(f"{request.node.name}: marker trial: {error}; see pytest --markers", pytrace=False)


def _described(
    trial: Trial | TrialName,
    agent: Agent | type[Agent] | str | None = None,
    until: float | None = None,
    *,
    vary: bool = False,
    files: str | Path | Sequence[str | Path] = (),
    servo: str | None = None,
    **more: Any,
) -> _Request:
    """Return the run of the marker's arguments; `set` is among `more`, since Python has a type of this name.

    Raises:
        TypeError: an argument is unknown, or does not go with the others.
    """
    overrides = more.pop("set", ())
    if more:
        raise TypeError(f"unexpected keyword argument {next(iter(more))!r}")
    from cellwright.config.arm import ServoProfile

    profiles = get_args(ServoProfile)
    if servo not in (None, *profiles):
        raise TypeError(f"servo must be one of {', '.join(profiles)} (got {servo!r})")
    named: Trial | tuple[str | Path, ...]
    if isinstance(trial, str | Path | list | tuple):
        named = (*_listed(trial), *_listed(files))
    elif files or overrides:
        raise TypeError("files and set need a trial by name or file (got an object)")
    else:
        named = cast("Trial", trial)
    return _Request(named, agent, until, vary, tuple(map(str, _listed(overrides))), servo)


def _listed(value: str | Path | Sequence[str | Path]) -> Sequence[str | Path]:
    return [value] if isinstance(value, str | Path) else value


def _warn(line: object) -> None:
    from cellwright.running.run import DescriptionWarning

    warnings.warn(str(line), DescriptionWarning, stacklevel=2)
