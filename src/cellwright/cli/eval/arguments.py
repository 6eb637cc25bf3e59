"""Options of `cellwright eval`, and the trials that they name."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

from cellwright.cell.kitting.attainable import attainable_score
from cellwright.cli import options
from cellwright.cli.arguments import AGENT_HELP, OUTPUT, SIMULATION, VIEW_HELP, VIEWING, AsJson, PageArguments, Vary
from cellwright.cli.eval.conclusion import AsTable, Reports, require_table, threshold_of
from cellwright.cli.options import N
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.policies import PolicyArguments, is_recording
from cellwright.clients.policies.program import check_policy
from cellwright.config.sensors import PictureCameraConfig
from cellwright.config.trial.catalogue import bundled_sensors
from cellwright.config.trial.gear2017 import load_trial
from cellwright.config.trial.joining import joined_name, split_names
from cellwright.config.trial.trial import Trial
from cellwright.rendering.backend import requested_backend
from cellwright.running.evaluation.outputs.tracking import Tracking
from cellwright.running.evaluation.plan.job import MEBIBYTE, EvaluatedTrial, RunLimits, models_digest
from cellwright.running.evaluation.plan.recordings import is_replay
from cellwright.running.evaluation.plan.seeds import read_seeds
from cellwright.running.evaluation.plan.shard import Shard
from cellwright.running.evaluation.plan.sweep import Sweep, check_effect, variant_name, variants
from cellwright.running.evaluation.results.summary import Threshold
from cellwright.running.evaluation.results.width_rule import LEAST, MOST, WidthRule

ARM_AND_SENSORS = bundled_sensors()[0]
"""Files with the arm and sensors that a trial of the competition lacks, where each team brought its own."""

_LIMITS, _TRUST = "Limits of each run", "Programs that you do not trust"
_NUMBER = "Number of runs"
_MAX_JOBS = 1024
_MAX_COUNTED = 10_000  # seeds of a trial whose number follows from the results: each new one costs a look at all
_MEMORY = 256.0, 2.0**24  # [MiB]; with less a worker cannot begin


@dataclass(frozen=True)
class LimitArguments:
    """Options of the limits of each run."""

    time_limit: Annotated[float, option("T", "Wall time [s].", _LIMITS)] = 600.0
    start_limit: Annotated[
        float, option("T", "Simulation time until the program must have started the competition [s].", _LIMITS)
    ] = 300.0
    memory_limit: Annotated[float, option("M", "Memory [MiB].", _LIMITS)] = 2048.0

    def limits(self) -> RunLimits:
        """Return the limits."""
        return RunLimits(
            _within("--time-limit", self.time_limit, 0.1, options.LATEST),
            round(_within("--memory-limit", self.memory_limit, *_MEMORY) * MEBIBYTE),
            start=_within("--start-limit", self.start_limit, 1.0, options.LATEST),
        )


@dataclass(frozen=True)
class NumberArguments:
    """Options of the number of seeds."""

    seeds: Annotated[
        str | None,
        option("N", "Run each trial with the seeds 1 to N, or with those of a file, one a line. Default: 1.", _NUMBER),
    ] = None
    until_width: Annotated[
        float | None,
        option(
            "W",
            "Run each trial with the seeds 1, 2, 3, … until the 95 % interval is at most this wide, such as 0.14: that "
            "of the share of runs that pass, or of the points without a task and without --min-score.",
            _NUMBER,
        ),
    ] = None
    least: Annotated[
        int | None, option("N", f"Seeds at least, with --until-width. Default: {LEAST}.", _NUMBER, name="--min")
    ] = None
    most: Annotated[
        int | None, option("N", f"Seeds at most, with --until-width. Default: {MOST}.", _NUMBER, name="--max")
    ] = None

    def rule(self, threshold: Threshold | None) -> WidthRule | None:
        """Return the rule that ends the runs of a trial; None for a fixed number of seeds."""
        if self.until_width is None:
            if given := [name for name, each in (("--min", self.least), ("--max", self.most)) if each is not None]:
                options.refuse(f"{given[0]}: belongs to --until-width; add it, or give --seeds")
            return None
        if self.seeds is not None:
            options.refuse("--seeds: does not go with --until-width; leave one out, or give --max")
        width = self.until_width
        if not 0.0 < width <= 1.0:
            options.refuse(f"--until-width {width:g}: give a share of more than 0, at most 1, such as 0.14")
        least = _within("--min", LEAST if self.least is None else self.least, 2, _MAX_COUNTED)
        most = _within("--max", max(MOST, least) if self.most is None else self.most, 2, _MAX_COUNTED)
        if most < least:
            options.refuse(f"--max {most}: must be at least --min (got {least}); give more")
        return WidthRule(width, least, most, threshold)

    def numbers(self, rule: WidthRule | None) -> Sequence[int]:
        """Return the seeds, all that may be run with a rule."""
        if rule:
            return range(1, rule.most + 1)
        with options.errors_of("--seeds"):
            return read_seeds("1" if self.seeds is None else self.seeds)


@dataclass(frozen=True)
class EvaluationPageArguments(PageArguments):
    """Options of a page that outlives the evaluation."""

    view: Annotated[
        bool,
        flag("--view", f"{VIEW_HELP} The page stays at the end, until Ctrl-C; with --json it ends as well.", VIEWING),
    ] = False


@dataclass(frozen=True, kw_only=True)
class EvaluationArguments:
    """Arguments and options of `cellwright eval`, in the order of its help."""

    trials: Annotated[
        list[str],
        argument(
            "TRIAL",
            "Bundled trials, such as `lesson`, and YAML files. Each is a separate trial; files of one are joined as "
            "`final01+kitter_sensors`.",
        ),
    ]
    agent: Annotated[str, option("AGENT", f"{AGENT_HELP}.", SIMULATION)] = "kitter"
    policy: PolicyArguments
    agents: Annotated[
        list[str] | None,
        option(
            "PATTERN",
            "Evaluate each program of a class, such as `'students/*.py:Mine'`, over socket: one sheet with a row for "
            "each, and a file of feedback; repeatable.",
            SIMULATION,
        ),
    ] = None
    joined: Annotated[
        list[str] | None,
        option(
            "FILE",
            "Join this file to each trial, such as one with your arm and sensors; repeatable. "
            f"Default for trials without an arm: `{ARM_AND_SENSORS}`.",
            SIMULATION,
            name="--with",
        ),
    ] = None
    number: NumberArguments
    vary: Vary = False
    sweep: Annotated[
        list[str] | None,
        option(
            "KEY=A,B,C",
            "Run each trial with each value of this key of its file, such as `time_limit=60,120`; several give all "
            "combinations.",
            SIMULATION,
        ),
    ] = None
    repeat: Annotated[
        bool, flag("--repeat", "Run each trial and seed twice, and find programs that are not repeatable.", SIMULATION)
    ] = False
    jobs: Annotated[
        int | None,
        option("J", "Runs in parallel. Default: the number of processors, here or of the cluster.", SIMULATION),
    ] = None
    shard: Annotated[
        str | None,
        option("K/N", "Do part K of N of the runs, or `auto` by variables of Slurm or Kubernetes.", SIMULATION),
    ] = None
    ray: Annotated[
        str | None,
        option(
            "ADDRESS",
            "Run on the Ray cluster at this address, such as `auto` or HOST:PORT; `local` starts one here.",
            SIMULATION,
        ),
    ] = None
    limits: LimitArguments
    over: Annotated[
        str | None,
        option(
            "socket",
            "Run each program in a process of its own, which does not hold cell and referee; the results are the same.",
            _TRUST,
        ),
    ] = None
    verify: Annotated[
        bool,
        flag(
            "--verify",
            "Play each run's commands again in a process without the program; a run with another result fails.",
            _TRUST,
        ),
    ] = False
    min_score: Annotated[
        str | None,
        option("SCORE", "Exit with status 1 if a run scores less: points, or `75%` of the reachable points.", OUTPUT),
    ] = None
    out: Annotated[Path, option("FOLDER", "Folder for results, logs and reports.", OUTPUT)] = Path("evaluation")
    fresh: Annotated[
        bool,
        flag(
            "--fresh",
            "Run everything, also what has a valid result in FOLDER already, or in place of another program.",
            OUTPUT,
        ),
    ] = False
    record: Annotated[
        bool, flag("--record", "Record each run that has no result yet, to FOLDER/recordings.", OUTPUT)
    ] = False
    record_failed: Annotated[
        bool, flag("--record-failed", "As --record, but keep only the recordings of runs that do not pass.", OUTPUT)
    ] = False
    as_table: AsTable = False
    log: Annotated[
        list[str] | None, option("TRACKER", "Log the evaluation to `mlflow` or `wandb` as one run; repeatable.", OUTPUT)
    ] = None
    page: EvaluationPageArguments
    as_json: AsJson = False

    @property
    def numbers(self) -> Sequence[int]:
        """The seeds; with a `rule` all that may be run."""
        return self.number.numbers(self.rule)

    @property
    def rule(self) -> WidthRule | None:
        """The rule that ends the runs of a trial; None for a fixed number of seeds."""
        return self.number.rule(threshold_of(self.min_score))

    @property
    def workers(self) -> int | None:
        """The number of runs in parallel; None for that of the processors."""
        return None if self.jobs is None else _within("--jobs", self.jobs, 1, _MAX_JOBS)

    @property
    def part(self) -> Shard | None:
        """The part of the runs to do; None for all."""
        with options.errors_of("--shard"):
            return None if self.shard is None else Shard.read(self.shard)

    @property
    def reports(self) -> Reports:
        """The files to write at the end."""
        return Reports(self.out, threshold_of(self.min_score), self.as_table, self.as_json)

    def refuse(self) -> None:
        """Refuse invalid values, and options that do not go together."""
        if self.over not in (None, "socket"):
            options.refuse(f"--over {self.over}: give socket")
        threshold_of(self.min_score)
        if self.record and self.record_failed:
            options.refuse("--record keeps all recordings; leave out it or --record-failed")
        require_table(self.as_table)
        with options.errors_of("--log"):
            Tracking.require(self.log or ())
        specs = self.policy.specs(self.agent)
        if any(map(is_recording, specs)):
            options.refuse("--policy: a recording is one run; `cellwright run` replays it")
        _ = self.part, self.limits.limits()
        if self.ray is not None and is_replay(self.agent):
            options.refuse(f"--agent {self.agent}: recordings do not get to the nodes of --ray; leave one out")
        if self.rule is not None:
            refused = {"--shard": self.shard is not None, "--agents": bool(self.agents), "--repeat": self.repeat}
            if given := [name for name, is_given in refused.items() if is_given]:
                options.refuse(
                    f"{given[0]}: does not go with --until-width, which needs the results of all seeds so far; "
                    "give --seeds instead"
                )
        if self.agents:
            refused = {
                "--agent": self.agent != "kitter",
                "--shard": self.shard is not None,
                "--ray": self.ray is not None,
                "--log": bool(self.log),
                "--parquet": self.as_table,
                "--repeat": self.repeat,
                "--view": self.page.view,
                "--policy": self.policy.policy is not None,
            }
            if given := [name for name, is_given in refused.items() if is_given]:
                options.refuse(f"{given[0]}: does not go with --agents; leave one out")
        _ = self.numbers, self.workers

    @property
    def program(self) -> str:
        """Name of the agent, as `find_agent` takes it; that of a policy has its latency unless several are compared."""
        specs = self.policy.specs(self.agent)
        if not specs:
            return self.agent
        return (specs[0] if len(specs) == 1 else replace(specs[0], latency="")).words

    @property
    def latencies(self) -> Sequence[str]:
        """The latencies that are compared; one that is empty if there is nothing to compare."""
        specs = self.policy.specs(self.agent)
        return [each.latency for each in specs] if len(specs) > 1 else [""]

    def evaluated(self) -> list[EvaluatedTrial]:
        """Read the trials, and check that each fits the policy, if one works."""
        words = [each.words for each in self.policy.specs(self.agent)[:1]]

        def check(trial: Trial) -> None:
            for each in words:
                check_policy(each, trial)

        return evaluated_trials(self.trials, self.joined or [], list(map(Sweep.read, self.sweep or [])), check)


def evaluated_trials(
    names: Sequence[str],
    joined: Sequence[str],
    sweeps: Sequence[Sweep] = (),
    check: Callable[[Trial], None] = lambda _trial: None,
) -> list[EvaluatedTrial]:
    """Read the trials once, and check each: their errors are printed before anything starts."""
    entries = []
    for name in dict.fromkeys(names):
        alone = load_trial(options.paths([name])).trial
        if not alone.orders and len(names) > 1:
            others = joined_name([*(other for other in names if other != name), name][-2:])
            options.refuse(f"{name}: has no order, and is no trial beside others; to join it, write such as {others}")
        parts = [*split_names(name), *(joined or ([] if alone.has_arm else [ARM_AND_SENSORS]))]
        swept = variants(sweeps, name if len(names) > 1 else "")
        trials = [each.trial for each in options.load_variants([joined_name(parts)], swept)]
        check_effect(sweeps, trials)
        for trial in trials:
            check(trial)
        if any(isinstance(each, PictureCameraConfig) for trial in trials for each in trial.sensors):
            # An unknown backend is reported once, and not by every run.
            requested_backend()
        entries += [
            (name, parts, each, trial, attainable_score(trial)) for each, trial in zip(swept, trials, strict=True)
        ]
    how_often = Counter(trial for _, trial in {(name, trial.name) for name, _, _, trial, _ in entries})
    return [
        EvaluatedTrial(
            variant_name(trial.name if how_often[trial.name] == 1 else name, overrides),
            tuple(path.resolve() for path in options.paths([joined_name(parts)])),
            attainable.total if trial.task is None else 1.0,
            attainable.maximum if trial.task is None else 1.0,
            trial.time_limit,
            models_digest(trial),
            tuple(parts),
            overrides,
            has_task=trial.task is not None,
        )
        for name, parts, overrides, trial, attainable in entries
    ]


def _within(option: str, value: N, low: float, high: float) -> N:
    return options.in_range(option, value, low, high, f"a number from {low:g} to {high:g}")
