"""One run of an evaluation, and the key that identifies it."""

import hashlib
import importlib.util
import json
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import entry_points
from itertools import product
from pathlib import Path
from typing import Any

from cellwright._package import FOLDER
from cellwright.clients.agents.agent import BUNDLED, OPERATOR, REPLAY
from cellwright.clients.policies.latency import Latency
from cellwright.clients.policies.spec import PolicySpec, is_policy
from cellwright.config.parsing.overrides import Override
from cellwright.config.trial.joining import joined_name
from cellwright.config.trial.trial import Trial
from cellwright.running.evaluation.plan.imports import imported_files, module_files
from cellwright.running.evaluation.plan.recordings import Recordings, is_replay
from cellwright.running.run import versions
from cellwright.util.errors import UsageError
from cellwright.util.plugins import is_class_path

MEBIBYTE = 1 << 20
_MAX_NAME = 60  # letters of a trial's name in a file name, which Windows wants to be short

_KEY_LENGTH = 24
LATENCY = "latency_ms"
"""Name of a compared latency among the overrides of a run."""


@dataclass(frozen=True, slots=True)
class RunLimits:
    """Limits of one run.

    Attributes:
        wall: wall time [s].
        memory: memory [bytes] of its process and of the processes that it has started; enforced on Linux only.
        log: size of its log [bytes].
        start: simulation time [s] until the competition must have started.
    """

    wall: float = 600.0
    memory: int = 2048 * MEBIBYTE
    log: int = 16 * MEBIBYTE
    start: float = 300.0


@dataclass(frozen=True, slots=True)
class EvaluatedTrial:
    """A trial in an evaluation.

    Attributes:
        name: its name in reports.
        files: its files, as absolute paths.
        reachable: the most points that an agent can earn in it; 1 with a task, whose success is what counts.
        best: points of its orders if all of them could be reached; 1 with a task.
        time_limit: simulation time [s] that it lasts at most; None without a limit.
        models: digest of its own models, from `models_digest`.
        given: its files as a user names them on the command line.
        overrides: values that replace those of its files.
        has_task: True if it has a task.
    """

    name: str
    files: tuple[Path, ...]
    reachable: float
    best: float
    time_limit: float | None
    models: str = ""
    given: tuple[str, ...] = ()
    overrides: tuple[Override, ...] = ()
    has_task: bool = False


@dataclass(frozen=True, slots=True)
class Job:
    """One run of an evaluation: the same job has the same result, on any machine and at any time.

    Attributes:
        agent: the agent's name, as for `find_agent`.
        vary: True if the seed varies the cell within its bounds.
        key: digest of all that the result depends on, and of what protects it.
        over: `socket` for a program in a process of its own; empty for one in the referee's.
        verify: True if its commands are played once more, in a process without the program.
        latency: latency of its policy, where an evaluation compares several; empty otherwise.
        recording: file whose commands the agent `replay:…` sends in this run; empty for any other agent.
    """

    trial: EvaluatedTrial
    agent: str
    seed: int
    vary: bool
    key: str
    over: str = ""
    verify: bool = False
    latency: str = ""
    recording: str = ""

    @property
    def program(self) -> str:
        """Name of its agent, as `find_agent` takes it: with its recording, or the latency and seed of its policy."""
        if self.recording:
            return f"{REPLAY}{self.recording}"
        if not is_policy(self.agent):
            return self.agent
        spec = PolicySpec.read(self.agent)
        return replace(spec, latency=self.latency or spec.latency, seed=self.seed).words

    @property
    def overrides(self) -> dict[str, str]:
        """Values that distinguish it from runs of the same trial, by key: of the trial's files, and the latency."""
        found = {each.key: each.value for each in self.trial.overrides}
        return found | ({LATENCY: latency_value(self.latency)} if self.latency else {})

    @property
    def name(self) -> str:
        """Name of the job for people."""
        return f"{self.trial.name} seed {self.seed}"

    @property
    def command(self) -> str:
        """Command that repeats this run alone."""
        files = self.trial.given or tuple(map(str, self.trial.files))
        more = ["--vary"] if self.vary else []
        more += [word for each in self.trial.overrides for word in ("--set", str(each))]
        more += ["--over", self.over, "--lockstep"] if self.over else []
        agent = ["--agent", self.program]
        if is_policy(self.agent):
            agent = shlex.split(replace(PolicySpec.read(self.program), seed=0).words)[1:]
        words = ["cellwright", "run", joined_name(files), *agent, "--seed", str(self.seed), *more]
        return shlex.join(words)

    @property
    def log_name(self) -> str:
        """Name of the file for its output."""
        return log_name(self.trial.name, self.seed, self.key)


def log_name(trial: str, seed: int, key: str) -> str:
    """Return the name of the file for a run's output; trials with the same letters and digits have their own key."""
    letters, digits = (
        "".join(each if each.isalnum() else "_" for each in text) for text in (trial[:_MAX_NAME], key[:8])
    )
    return f"{letters}-{seed}-{digits}.log"


def make_jobs(
    trials: Iterable[EvaluatedTrial],
    agent: str,
    seeds: Sequence[int],
    *,
    vary: bool,
    over: str = "",
    verify: bool = False,
    latencies: Sequence[str] = ("",),
) -> list[Job]:
    """Return a job for every trial with every latency and seed; `over` and `verify` as for `Job`.

    Raises:
        UsageError: the agent sends recorded commands, and there is no recording for a run; or it is a person.
        OSError: a file cannot be read.
    """
    if agent == OPERATOR:
        raise UsageError(f"agent {OPERATOR}: a person works the cell, once; use cellwright run TRIAL --operator")
    recordings = Recordings(agent) if is_replay(agent) else None
    program = agent_digest(agent) if recordings is None else agent
    jobs: dict[str, Job] = {}
    for trial, latency in product(trials, latencies):
        facts = key_facts(trial, program)
        facts |= ({"over": over} if over else {}) | ({"verify": True} if verify else {})
        facts |= {"latency": _latency_digest(latency)} if latency else {}
        swept = trial if not latency else replace(trial, name=f"{trial.name} {LATENCY}={latency_value(latency)}")
        for seed in seeds:
            recording = "" if recordings is None else str(recordings.of(swept.name, seed, vary=vary))
            own = {"recording": _sources_digest([Path(recording)])} if recording else {}
            key = _key(facts | own, seed, vary=vary)
            jobs.setdefault(key, Job(swept, agent, seed, vary, key, over, verify, latency, recording))
    return list(jobs.values())


def latency_value(latency: str) -> str:
    """Return a latency for reports: the milliseconds of a fixed one, so that a sweep can be drawn; else its text.

    Example:
        >>> latency_value("0.12s"), latency_value("measured")
        ('120', 'measured')
    """
    source = Latency.read(latency)
    return f"{float(source.times[0]) * 1000:g}" if source.kind == "fixed" else latency


def key_facts(trial: EvaluatedTrial, program: str) -> dict[str, Any]:
    """Return what the result of a trial depends on besides seed and variation, by name; `program` is its digest.

    Raises:
        OSError: a file of the trial cannot be read.
    """
    texts = [*(file.read_bytes() for file in trial.files), trial.models.encode()]
    # Whatever can change a result is part of its key, so that a result on disk is taken up only if it would come again.
    facts = {
        "trial": [hashlib.sha256(text).hexdigest() for text in texts],
        "agent": program,
        "versions": versions(),
        "source": _cellwright_digest(),
    }
    return facts | ({"overrides": list(map(str, trial.overrides))} if trial.overrides else {})


def repeated(job: Job) -> Job:
    """Return the same job once more, under a key of its own."""
    return replace(job, key=repeated_key(job.key))


def repeated_key(key: str) -> str:
    """Return the key of the repetition of a job."""
    return hashlib.sha256(f"{key} repeated".encode()).hexdigest()[:_KEY_LENGTH]


def _key(facts: Mapping[str, Any], seed: int, *, vary: bool) -> str:
    known = {**facts, "seed": seed, "vary": vary}
    return hashlib.sha256(json.dumps(known, sort_keys=True).encode()).hexdigest()[:_KEY_LENGTH]


def models_digest(trial: Trial) -> str:
    """Return the digest of a trial's own part types, furniture, arms and robots, and of their files, anywhere."""
    models = [*trial.part_models.values(), *(each.model for each in trial.furniture)]
    robots = trial.robot_models.values()
    described = [*(arm.robot for arm in trial.arm_models.values()), *(each.robot for each in robots)]
    links = [link for robot in described for link in robot.links.values()]
    shapes = [
        *(shape for model in models for shape in model.shapes),
        *(shape for link in links for shape in link.shapes),
    ]
    configs = [path for each in robots for path in (each.path, each.urdf_path)]
    named = [*(shape.mesh for shape in shapes), *(model.mjcf for model in models), *configs]
    files = [file for file in named if file is not None]
    text = repr((trial.part_models, trial.furniture, trial.arm_models, trial.robot_models))
    # Machines may have the files in other folders: names and contents count, not paths.
    for file in files:
        text = text.replace(repr(file), repr(file.name))
    digest = hashlib.sha256(text.encode())
    for file in files:
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest() if models or links else ""


def agent_digest(agent: str) -> str:
    """Return the digest of an agent's name and of its program, which is read and not run.

    The program is its file with all that it imports from the folder or package. If it computes what it imports, these
    are all Python files beside it, or the whole package.
    """
    if is_policy(agent):
        return _policy_digest(agent)
    installed = {each.name: each.value for each in entry_points(group="cellwright.agents")}  # agents of other packages
    place = BUNDLED.get(agent, installed.get(agent, agent)).rpartition(":")[0]
    return f"{agent} {_sources_digest(_sources(place))}"


def _policy_digest(words: str) -> str:
    """Return the digest of a policy's words, its files and its program; what runs behind an address is not known."""
    spec = PolicySpec.read(words)
    texts = [hashlib.sha256(file.read_bytes()).hexdigest() for file in spec.files]
    place = spec.policy.rpartition(":")[0] if is_class_path(spec.policy) and "://" not in spec.policy else ""
    return " ".join([words, *texts, *([_sources_digest(_sources(place))] if place else [])])


def _latency_digest(latency: str) -> str:
    """Return a latency with the digest of its file, if it has one."""
    kind, _, path = latency.partition(":")
    return f"{latency} {hashlib.sha256(Path(path).read_bytes()).hexdigest()}" if kind == "file" else latency


def _sources(place: str) -> list[Path]:
    if place.endswith(".py"):
        file = Path(place).resolve()
        return _program([file], file.parent, file.parent.glob("*.py"))
    top = place.partition(".")[0]
    if not top.isidentifier():
        # no such module; the check of the agent reports it
        return []
    if top == Path(FOLDER).name:
        # The digest of Cellwright covers it.
        return []
    here = Path.cwd()
    local = Path(f"{top}.py")
    # modules are found in the working folder
    if local.is_file():
        return _program(module_files(place, [here]), here, local.resolve().parent.glob("*.py"))
    spec = None if Path(top).is_dir() else importlib.util.find_spec(top)
    if spec is None or spec.origin is None:
        return _program(module_files(place, [here]), here, Path(top).resolve().rglob("*.py"))
    origin = Path(spec.origin)
    if origin.name != "__init__.py":
        return [origin]
    folder = origin.parent.parent
    return _program(module_files(place, [folder]), folder, origin.parent.rglob("*.py"), top)


def _program(first: Sequence[Path], folder: Path, otherwise: Iterable[Path], package: str = "") -> list[Path]:
    """Return the files of a program, sorted; `otherwise` those that count if its imports are not known."""
    found = imported_files(first, [folder], package)
    return sorted(otherwise) if found is None or not found else sorted(found)


@cache
def _cellwright_digest() -> str:
    """Return the digest of Cellwright's own source, which changes between two releases while the version stays."""
    return _sources_digest(sorted(Path(FOLDER).rglob("*.py")))


def _sources_digest(files: Iterable[Path]) -> str:
    digest = hashlib.sha256()
    # an editor's lock is a link without a target
    for file in filter(Path.is_file, files):
        digest.update(f"{file.name}\0".encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
