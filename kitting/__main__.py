"""`python -m kitting`: makes demonstrations, trains the clone, scores programs, and checks submissions."""

from __future__ import annotations

import os
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from rich.console import Console

from cellwright.cli.main import DONE, NOT_DONE, main
from cellwright.cli.output import progress_bar
from cellwright.cli.parameters import argument, flag, option, with_groups
from cellwright.util.errors import UsageError
from cellwright.util.files import write_atomic
from kitting.baselines import BASELINES, CLONE, RECORDED, REPLAY, find_baseline
from kitting.benchmark import BUILD, ROOT, TASKS, Split, find_tasks
from kitting.card import generated
from kitting.clone.agent import FOLDER, network_file
from kitting.clone.training import STEPS, train_clone
from kitting.croissant import RESULTS
from kitting.evaluate import Runs, evaluate, recordings, records
from kitting.scores import outcomes_text, table
from kitting.submission import OUTCOMES, Entrant, as_text, make_submission, verify

SUBMISSION = "submission.json"
"""File of a submission."""
DEMONSTRATIONS, SCORES, CLONES, VERIFIED = "demonstrations", "scores", "clone", "verified"
"""Folders of what is made."""
DEMONSTRATOR = ("--agent", "kitting.demonstrator:Demonstrator")
"""Program of the demonstrations."""
_NAMES = ", ".join(f"`{each.name}`" for each in TASKS)

Out = Annotated[Path, option("FOLDER", "Folder of all that is made.")]
Jobs = Annotated[int | None, option("J", "Runs in parallel. Default: the number of processors.")]
TaskNames = Annotated[list[str] | None, option("TASK", f"Only this task of {_NAMES}; repeatable.", name="--task")]

app = typer.Typer(add_completion=False, rich_markup_mode="markdown", pretty_exceptions_enable=False)


@dataclass(frozen=True)
class ProgramArguments:
    """Options that name a program, as for `cellwright eval`."""

    agent: Annotated[str | None, option("AGENT", "The program: an agent.")] = None
    policy: Annotated[str | None, option("ADDRESS", "The program: a policy.")] = None
    policy_map: Annotated[str | None, option("MAP", "Map of the policy.")] = None
    latency: Annotated[str | None, option("LATENCY", "Latency of the policy.")] = None

    def words(self, name: str, out: Path) -> list[str]:
        """Return the options of `cellwright eval` for a program of this name; a UsageError if they do not fit it."""
        given = {
            "--agent": self.agent,
            "--policy": self.policy,
            "--policy-map": self.policy_map,
            "--latency": self.latency,
        }
        words = [word for key, value in given.items() if value is not None for word in (key, value)]
        if name in BASELINES and words:
            raise UsageError(f"{name}: is a baseline, a program of its own; leave out {words[0]}, or take another name")
        if name in BASELINES:
            return find_baseline(name).words(out / SCORES)
        if self.agent is None and self.policy is None:
            raise UsageError(f"{name}: is no baseline ({', '.join(BASELINES)}); give its program: --agent or --policy")
        if not name.replace("-", "").replace("_", "").isalnum():
            raise UsageError(f"{name}: a name has letters, digits, - and _; take another")
        return words


@dataclass(frozen=True)
class RunArguments:
    """Options of the runs."""

    task: TaskNames = None
    seeds: Annotated[int | None, option("N", "Only the first N seeds of each task. Default: all.")] = None
    jobs: Jobs = None

    def runs(self, split: Split, *, record: bool = False, fresh: bool = False) -> Runs:
        """Return the runs of a split."""
        return Runs(find_tasks(self.task or []), split, self.seeds, self.jobs, record, fresh)


@app.command("tasks")
def list_tasks() -> None:
    """List the tasks, their sentences and what they vary."""
    for each in TASKS:
        typer.echo(f"{each.name:<14} {each.task.sentence}\n{'':<14} {each.axis}")


@app.command()
@with_groups
def demonstrate(given: RunArguments, out: Out = BUILD) -> None:
    """Make the demonstrations: recorded runs on the seeds of the training, in many styles and with mistakes."""
    found = evaluate(given.runs(Split.TRAIN, record=True), DEMONSTRATOR, out / DEMONSTRATIONS)
    typer.echo(f"\n{table({DEMONSTRATIONS: found})}")


@app.command()
def train(
    task: TaskNames = None,
    steps: Annotated[int, typer.Option(metavar="N", min=1, help="Steps of training of each task.")] = STEPS,
    out: Out = BUILD,
) -> None:
    """Train the clone, a network for each task, from the demonstrations; later scores use these networks."""
    for each in find_tasks(task or []):
        files = recordings(out / DEMONSTRATIONS, each, Split.TRAIN)
        with progress_bar(Console(stderr=True), each.name, 1.0) as show:
            trained = train_clone(files, steps, on_progress=show or (lambda _share, _status: None))
        trained.network.save(network_file(each, out / CLONES))
        about = f"{trained.demonstrations} demonstrations, {trained.samples} samples, error {trained.error:.3f}"
        typer.echo(f"{each.name:<14} {about}")


@app.command()
@with_groups
def score(
    name: Annotated[str, argument("NAME", "Name of the program, or of a baseline.")],
    program: ProgramArguments,
    given: RunArguments,
    out: Out = BUILD,
) -> None:
    """Score a program on the seeds of the test, with 95 % intervals.

    python -m kitting score kitter --seeds 20

    python -m kitting score mine --policy ws://127.0.0.1:8000
    """
    words = program.words(name, out)
    if name == REPLAY and not (out / SCORES / RECORDED).is_dir():
        raise UsageError(f"{name}: needs the recorded runs of {RECORDED}; run python -m kitting score {RECORDED} first")
    _use_trained(out)
    # the key of a run does not cover the networks
    runs = given.runs(Split.TEST, record=name == RECORDED, fresh=name == CLONE)
    found = evaluate(runs, words, out / SCORES / name)
    typer.echo(f"\n{table({name: found})}\n{sum(each.wall for each in found) / 3600.0:.3f} core hours")


@app.command("table")
def show_table(
    out: Out = BUILD,
    publish: Annotated[
        bool, flag("--publish", "Write the runs of the baselines that were scored, and the card.")
    ] = False,
) -> None:
    """Print the table of all programs that were scored."""
    names = sorted(each.parent.name for each in (out / SCORES).glob("*/plan.json"))
    found = {name: records(out / SCORES / name) for name in [*BASELINES, *names] if name in names}
    if not found:
        raise UsageError(f"{out}: has no scores; run python -m kitting score NAME first")
    typer.echo(table(found))
    if publish:
        RESULTS.parent.mkdir(exist_ok=True)
        write_atomic(RESULTS, outcomes_text({name: found[name] for name in BASELINES if name in found}))
        write_card()


@app.command()
@with_groups
def submit(
    entrant: Annotated[Path, argument("ENTRANT.json", "Name, authors and the rest that only you know.")],
    folder: Annotated[Path, argument("FOLDER", "Folder for the submission.")],
    program: ProgramArguments,
    out: Out = BUILD,
) -> None:
    """Write the submission of a program that was scored: its numbers, and all its runs beside them."""
    try:
        known = msgspec.json.decode(entrant.read_bytes(), type=Entrant)
    except OSError as error:
        raise UsageError(f"{entrant}: cannot be read: {error.strerror or error}") from None
    except msgspec.MsgspecError as error:
        raise UsageError(f"{entrant}: {error}; see kitting/README.md for what it must have") from None
    words = program.words(known.name, out)
    submission, outcomes = make_submission(known, words, records(out / SCORES / known.name))
    folder.mkdir(parents=True, exist_ok=True)
    write_atomic(folder / OUTCOMES, outcomes)
    write_atomic(folder / SUBMISSION, as_text(submission))
    typer.echo(f"submission  {folder / SUBMISSION}")


@app.command("verify")
def verify_submission(
    submission: Annotated[Path, argument(SUBMISSION, "The submission.")], jobs: Jobs = None, out: Out = BUILD
) -> None:
    """Run everything of a submission again, and compare each run.

    Exit status: 0 every number came again; 1 some did not; 2 it is no submission of this version.
    """
    _use_trained(out)
    found = verify(submission, out / VERIFIED / submission.resolve().parent.name, jobs)
    typer.echo("\n".join([*found, f"{len(found)} runs differ" if found else "every number came again"]))
    raise typer.Exit(NOT_DONE if found else DONE)


@app.command("card")
def write_card() -> None:
    """Write the tables of the card, the schema of submissions and the description in Croissant."""
    for name, text in generated():
        write_atomic(ROOT / name, text)


def _use_trained(out: Path) -> None:
    """Let the clone use the networks that were trained here, if there are any."""
    if (out / CLONES).is_dir():
        os.environ.setdefault(FOLDER, str((out / CLONES).resolve()))


if __name__ == "__main__":
    sys.exit(main(None, app, name="python -m kitting"))
