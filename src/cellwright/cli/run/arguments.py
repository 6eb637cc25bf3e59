"""Options of `cellwright run`."""

import logging
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from cellwright.cli import options, output
from cellwright.cli.arguments import (
    AGENT_HELP,
    END,
    LOCKSTEP_HELP,
    OUTPUT,
    SIMULATION,
    SPEED_HELP,
    TRIAL,
    VIEW_HELP,
    VIEWING,
    AsJson,
    CellArguments,
    Development,
    Log,
    PageArguments,
    PictureCamera,
    Record,
    Until,
    VideoArguments,
)
from cellwright.cli.parameters import flag, option
from cellwright.cli.policies import PolicyArguments
from cellwright.clients.agents.agent import Agent, find_agent
from cellwright.rendering.backend import requested_backend
from cellwright.running.run import Program, RunOptions, Session
from cellwright.running.run.observers import Pictures, Quality

SAVE, PROCESSES = "Checkpoints", "Agent and cell in two processes"
"""Headings for options in the help."""


@dataclass(frozen=True)
class ProcessArguments:
    """Options of the processes of agent and cell."""

    over: Annotated[
        str | None,
        option(
            "TRANSPORT",
            "Run the agent in its own process, connected to the cell over a `socket`, `ros1` or `ros2`.",
            PROCESSES,
        ),
    ] = None
    lockstep: Annotated[
        bool,
        flag("--lockstep", f"{LOCKSTEP_HELP}; requires --over, and gives the same result as one process.", PROCESSES),
    ] = False
    connect: Annotated[
        str | None,
        option(
            "HOST:PORT", "Work the cell that `cellwright serve` serves at this address, instead of a TRIAL.", PROCESSES
        ),
    ] = None

    def refuse(self) -> None:
        """Refuse a transport that there is not, and lockstep without one."""
        if self.over is None and self.lockstep:
            options.refuse(
                "--lockstep requires --over (for example --over socket); in-process runs are always lockstep"
            )
        if self.over not in (None, "socket", "ros1", "ros2"):
            options.refuse(f"--over {self.over}: give socket, ros1 or ros2")

    def program(self, agent: str, *, has_end: bool, is_verbose: bool) -> Callable[[], Agent | Program | None]:
        """Return a factory for each run: an agent of its own, one in a process of its own, or None for no agent."""
        if agent == "none":
            if not has_end:
                options.refuse("--agent none requires --until SECONDS: without an agent a run has no end")
            return lambda: None
        make = find_agent(agent)
        if self.over is None:
            return make
        from cellwright.running.remote.hosting import RemoteAgent

        def print_line(line: str) -> None:
            sys.stdout.write(f"{line}\n")

        remote = RemoteAgent(agent, level=logging.INFO if is_verbose else logging.WARNING, on_message=print_line)
        return lambda: remote


@dataclass(frozen=True)
class RunPageArguments(PageArguments):
    """Options of a page that outlives the run."""

    view: Annotated[
        bool,
        flag(
            "--view",
            f"{VIEW_HELP} The page stays after the run, until Ctrl-C; with --json it ends with the run.",
            VIEWING,
        ),
    ] = False


@dataclass(frozen=True)
class ViewingArguments:
    """Options of pictures, page and listeners."""

    snapshot: Annotated[
        list[str] | None, option("T:FILE.png", "Take a picture at a simulation time [s]; repeatable.", VIEWING)
    ] = None
    picture: Annotated[bool, flag("--picture/--no-picture", "Write TRIAL.png at the end.", VIEWING)] = True
    camera: PictureCamera = "overview"
    page: RunPageArguments = RunPageArguments()
    quality: Annotated[
        Quality, option("QUALITY", "Quality of pictures: `fast`, by OpenGL as in videos, or `fine`, by rays.", VIEWING)
    ] = Quality.FAST
    listen: Annotated[
        list[str] | None, option("TOPIC", "Count the messages of a topic, or of `all`; repeatable.", VIEWING)
    ] = None

    def pictures(self) -> Pictures:
        """Return the pictures of the run."""
        if self.quality is Quality.FAST and (self.picture or self.snapshot):
            requested_backend()
        snapshots = [options.timed_file("--snapshot", text, ".png") for text in self.snapshot or ()]
        return Pictures(options.camera(self.camera), snapshots, output.warn, self.quality)


@dataclass(frozen=True, kw_only=True)
class RunArguments:
    """Arguments and options of `cellwright run`, in the order of its help."""

    files: Annotated[list[str] | None, TRIAL] = None
    agent: Annotated[str, option("AGENT", f"{AGENT_HELP}; `none` for no agent.", SIMULATION)] = "kitter"
    operator: Annotated[
        bool,
        flag(
            "--operator",
            "A person works the cell in place of an agent: on its page, which opens, by its keys or over topics.",
            SIMULATION,
        ),
    ] = False
    cell: CellArguments
    policy: PolicyArguments
    speed: Annotated[
        str | None,
        option(
            "FACTOR",
            f"{SPEED_HELP} Default: `max`, but `1` with --view, and with --over and no --lockstep.",
            SIMULATION,
        ),
    ] = None
    process: ProcessArguments
    development: Development = False
    until: Until = None
    min_score: Annotated[float | None, option("POINTS", "Exit with status 1 if the score is less.", END)] = None
    viewing: ViewingArguments
    video: VideoArguments
    checkpoint: Annotated[
        list[str] | None,
        option(
            "T:FILE.npz",
            "Save a checkpoint at this simulation time [s]; repeatable. It changes the state hash of the run.",
            SAVE,
        ),
    ] = None
    resume: Annotated[
        Path | None, option("FILE.npz", "Resume from a checkpoint; the agent starts from its beginning.", SAVE)
    ] = None
    as_json: AsJson = False
    log: Log = None
    record: Record = None
    averages: Annotated[
        str | None,
        option(
            "COST,TIME",
            "Score the trial as in the finals, from these averages of all teams [$, s], with a time for each order.",
            OUTPUT,
        ),
    ] = None
    verbose: Annotated[bool, flag("--verbose -v", "Print the agent's log messages.", OUTPUT)] = False

    def run_options(self, *observers: Callable[[Session], AbstractContextManager[Any]]) -> RunOptions:
        """Return the options of the run with its observers."""
        saved = [options.timed_file("--checkpoint", text, ".npz") for text in self.checkpoint or ()]
        return RunOptions(
            until=self.until,
            listen=self.viewing.listen or (),
            checkpoints=saved,
            start=self.resume,
            observers=observers,
        )
