"""One run that is to be judged, and the key by which it is known again."""

import hashlib
import importlib.util
import json
import shlex
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from pathlib import Path

from cellwright._package import FOLDER
from cellwright.clients.agents.agent import BUNDLED
from cellwright.config.trial.trial import Trial
from cellwright.running.run import versions

_LONGEST = 60  # letters of a trial's name in that of a file, which Windows wants to be short


@dataclass(frozen=True, slots=True)
class EvaluatedTrial:
    """A trial as it takes part in an evaluation.

    Attributes:
        name: what reports call it.
        files: its files, as absolute paths.
        reachable: the most points that anybody can earn in it.
        best: what its orders would earn if nothing were out of reach.
        time_limit: simulation time [s] that it lasts at most; not positive for one without an end.
        models: digest of the models of its own, from `models_digest`.
        given: its files as somebody would name them on the command line.
    """

    name: str
    files: tuple[Path, ...]
    reachable: float
    best: float
    time_limit: float
    models: str = ""
    given: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Job:
    """A run to be judged: the same job has the same result, whoever works it and when.

    Attributes:
        agent: who works it, as for `find_agent`.
        vary: whether the cell is moved about within its bounds, by the seed.
        key: digest of all that the result depends on.
    """

    trial: EvaluatedTrial
    agent: str
    seed: int
    vary: bool
    key: str

    @property
    def name(self) -> str:
        """What people call it."""
        return f"{self.trial.name} seed {self.seed}"

    @property
    def command(self) -> str:
        """The command that does the same run alone."""
        files = self.trial.given or tuple(map(str, self.trial.files))
        varied = ["--vary"] if self.vary else []
        return shlex.join(["cellwright", "run", *files, "--agent", self.agent, "--seed", str(self.seed), *varied])

    @property
    def log_name(self) -> str:
        """Name of the file that takes what it prints."""
        trial = "".join(letter if letter.isalnum() else "_" for letter in self.trial.name[:_LONGEST])
        return f"{trial}-{self.seed}-{self.key[:8]}.log"


def make_jobs(trials: Iterable[EvaluatedTrial], agent: str, seeds: Sequence[int], *, vary: bool) -> list[Job]:
    """Every trial with every seed, once.

    Raises:
        OSError: a file cannot be read.
    """
    program = agent_digest(agent)
    jobs: dict[str, Job] = {}
    for trial in trials:
        texts = [file.read_bytes() for file in trial.files]
        for seed in seeds:
            key = _key([*texts, trial.models.encode()], program, seed, vary=vary)
            jobs.setdefault(key, Job(trial, agent, seed, vary, key))
    return list(jobs.values())


def _key(texts: Sequence[bytes], program: str, seed: int, *, vary: bool) -> str:
    known = {
        "trial": [hashlib.sha256(text).hexdigest() for text in texts],
        "agent": program,
        "seed": seed,
        "vary": vary,
        "versions": versions(),
        "source": _cellwright_digest(),
    }
    return hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:24]


def models_digest(trial: Trial) -> str:
    """Digest of the part types and the furniture of somebody's own in a trial, with the files that they are made of.

    Raises:
        OSError: a file cannot be read.
    """
    models = [*trial.part_models.values(), *(each.model for each in trial.furniture)]
    files = [shape.mesh for model in models for shape in model.shapes] + [model.mjcf for model in models]
    digest = hashlib.sha256(repr((trial.part_models, trial.furniture)).encode())
    for file in filter(None, files):
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest() if models else ""


def agent_digest(agent: str) -> str:
    """Digest of an agent's name and of its program, which is read and not run.

    The program is its file and the Python files beside it, or all of the package that its module is in.
    """
    brought = {each.name: each.value for each in entry_points(group="cellwright.agents")}  # by other packages
    place = BUNDLED.get(agent, brought.get(agent, agent)).rpartition(":")[0]
    return f"{agent} {_sources_digest(_sources(place))}"


def _sources(place: str) -> list[Path]:
    if place.endswith(".py"):
        return sorted(Path(place).resolve().parent.glob("*.py"))
    top = place.partition(".")[0]
    if not top.isidentifier():
        return []  # no module has such a name; the check of the agent says so
    local = Path(f"{top}.py")
    if local.is_file():  # modules are looked for in the folder that the command is called in
        return sorted(local.resolve().parent.glob("*.py"))
    spec = None if Path(top).is_dir() else importlib.util.find_spec(top)
    if spec is None or spec.origin is None:
        return sorted(Path(top).resolve().rglob("*.py"))
    origin = Path(spec.origin)
    return sorted(origin.parent.rglob("*.py")) if origin.name == "__init__.py" else [origin]


@cache
def _cellwright_digest() -> str:
    """Digest of Cellwright's own source: between two releases it has one version and changes all the same."""
    return _sources_digest(sorted(Path(FOLDER).rglob("*.py")))


def _sources_digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    for file in filter(Path.is_file, files):  # an editor's lock is a link that leads nowhere
        digest.update(f"{file.name}\0".encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
