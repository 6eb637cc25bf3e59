"""Session of a cell, a robot controller node or a recording: it runs, serves, shows, records and films it."""

from __future__ import annotations

import time
import warnings
import webbrowser
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from cellwright.cell.cell import Cell
from cellwright.cell.variation import Bounds
from cellwright.clients.agents.agent import Agent, find_agent, maker_of
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.robots import bundled as bundled_robots
from cellwright.config.robot.robots import find_robot, is_robot_file
from cellwright.config.trial.catalogue import bundled as bundled_trials
from cellwright.config.trial.joining import TrialName, find_files
from cellwright.config.trial.trial import Trial
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import WORLD_CHANGE
from cellwright.rendering.video_options import VideoOptions
from cellwright.running.run.agent_work import work_in_process
from cellwright.running.run.observers import has_desktop, keep_log, record_run, take_video
from cellwright.running.run.options import PageOptions, RecordOptions, RunOptions, ServerOptions, reachable_address
from cellwright.running.run.result import Outcome, SessionResult
from cellwright.running.run.targets import CellTarget, SessionState, Target, load_robot, load_trial, subscribe
from cellwright.util.errors import CellwrightError, RejectedCommandError, UsageError

if TYPE_CHECKING:
    from cellwright.middleware.ros1.host import Ros1
    from cellwright.middleware.ros2.host import Ros2, Ros2Options
    from cellwright.robot.node import RobotNode
    from cellwright.viewer.web.start import WebPage


_ONE_COURSE = "a recording, video or log of this run is being written, and has one course of time; run without them"
_POLL_PERIOD = 0.1  # [s]
_LAST_POLL = 0.7  # [s]: a page asks for its panel four times a second
RECORDINGS = (".mcap", ".bag")
"""Suffixes of recordings."""


def warn_at_runtime(line: str) -> None:
    """Issue a line as a `RuntimeWarning`."""
    warnings.warn(line, RuntimeWarning, stacklevel=2)


class Program(ABC):
    """Program that works a session in place of an agent in this process, such as an agent in a process of its own.

    Example:
        >>> import cellwright
        >>> class Steps(Program):
        ...     def work(self, session):
        ...         session.node.simulation.step()
        ...         return cellwright.Outcome.UNTIL, ""
        >>> cellwright.Session("lesson").run(Steps()).steps
        1
    """

    @abstractmethod
    def work(self, session: Session) -> tuple[Outcome, str]:
        """Let time pass until the run is over.

        Returns:
            How the run ended, and the error in words; empty if there was none.
        """


class Session(SessionState):
    """Session of a cell, a robot controller node or a recording: it runs, serves, shows, records, films and logs it.

    Its resources are open within a `with` block. A run of a cell starts at time 0; a session may have several runs.

    Example:
        >>> import cellwright
        >>> with cellwright.Session("lesson", until=0.1) as session:
        ...     session.run().simulated
        0.1

    Args:
        target: a trial or a robot, by its name or the path of its file; a recording (`run.mcap`); a `Trial`, `Cell`,
            `RobotConfig` or `RobotNode`.
        seed: seed of all random streams of a trial; None takes the trial's own.
        until: stop at this simulation time [s]; None: when the run is over, or on request.
        rate: simulated seconds a wall second, or a `RateControl`, which may change; None: as fast as it goes.
        lockstep: advance simulation time only on a client's request.
        serve: serve clients in other processes; the options hold the address.
        view: show it on a page in a browser; the options hold the address.
        ros1: also be a node of ROS 1.
        ros2: also be a node of ROS 2; the options hold its range, and arguments for rclpy.
        record: a file to record each run to (`run.mcap`, `run.bag`), or options. A second run has a file of its own.
        video: a file for a video of each run (`run.mp4`), or options.
        log: a file for the events of each run of a cell (`run.jsonl`).
        about: further facts of the caller about the run, such as the agent's name: for log and recording.
        observers: called with the session when a run starts; each returns a context manager, left when it is over.
        options: further options of a run of a cell.
        on_ready: called when clients can connect and time is about to pass.
        report: receives a line about a file or an address that is not as it should be.
        notice: receives a line about clients and ROS 1 meanwhile; None: as `report`.
        on_message: receives a line for people, such as the address of the page.

    Attributes:
        node: the cell, the robot controller node, or the player of the recording.
        rate: rate at which time passes.
        stop: stop condition of the run; `stop.request()` ends it from anywhere.
        server: serves the clients; None if there is none.
        page: the page; None if there is none.
        result: result of the newest run; None before.
        number: number of the newest run, from 1.

    Raises:
        UnknownNameError: there is no such trial, robot or file.
        UsageError: a trial and a robot share the name, the port is taken, or the page cannot be opened.
    """

    def __init__(
        self,
        target: TrialName | Trial | Cell | RobotConfig | RobotNode | Target,
        *,
        seed: int | None = None,
        until: float | None = None,
        rate: float | RateControl | None = None,
        lockstep: bool = False,
        serve: bool | ServerOptions = False,
        view: bool | PageOptions = False,
        ros1: bool = False,
        ros2: bool | Ros2Options = False,
        record: str | Path | RecordOptions | None = None,
        video: str | Path | VideoOptions | None = None,
        log: str | Path | None = None,
        about: Mapping[str, Any] | None = None,
        observers: Sequence[Callable[[Session], AbstractContextManager[Any]]] = (),
        options: RunOptions | None = None,
        on_ready: Callable[[Session], object] = lambda _: None,
        report: Callable[[str], None] = warn_at_runtime,
        notice: Callable[[str], None] | None = None,
        on_message: Callable[[str], None] = print,
    ) -> None:
        self.options = options or RunOptions()
        speed = self.options.speed if rate is None else rate
        self.target = target_of(target, seed=seed, is_real_time=speed == 1.0)
        self._is_paced = speed is not None
        self.rate = speed if isinstance(speed, RateControl) else RateControl(speed)
        until = self.options.until if until is None else until
        self.stop = StopCondition(None if until is None else nanoseconds(until))
        self.lockstep = lockstep
        self._serve = ServerOptions(port=0) if view and not serve else ServerOptions() if serve is True else serve
        self._view = PageOptions() if view is True else view
        self._ros1, self._ros2 = ros1, ros2
        self.about = dict(about or {})
        self.observers = list(observers)
        self._on_ready, self.report, self.notice, self.on_message = on_ready, report, notice or report, on_message
        self.record = (
            RecordOptions([Path(record)], self.about, report=report) if isinstance(record, str | Path) else record
        )
        self.record = self.options.record if self.record is None else self.record
        self.video = VideoOptions(Path(video)) if isinstance(video, str | Path) else video
        self.log = None if log is None else Path(log)
        self.on_poll: list[Callable[[], object]] = []
        """Called about ten times a wall second while a run is paced or served."""
        self.on_reset = []
        self.page: WebPage | None = None
        self.ros: Ros1 | None = None
        self.ros2: Ros2 | None = None
        self.ros2_keeper: ExitStack | None = None
        """Keeps the node of ROS 2 beyond this session, for one with another world; it gets `ros2` before it opens."""
        self._is_over = False
        self._run: ExitStack | None = None
        self._opened = ExitStack()

    def __enter__(self) -> Self:
        with ExitStack() as opened:
            self._open(opened)
            self._opened = opened.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        try:
            if self._run is not None:  # a client has let time pass
                with self._run:
                    self._end(self.target.outcome_by_now(), "")
        finally:
            self._opened.close()

    def _open(self, opened: ExitStack) -> None:
        target = self.target
        if self._ros1 or self._ros2:
            from cellwright.middleware.ros1.host.ros1 import SIMULATOR, Ros1

        if self._ros1:
            identity = target.identity or SIMULATOR
            self.ros = opened.enter_context(Ros1(self.notice, lambda: self.stop.is_requested, identity=identity))
            self.ros.prepare()
        if self._ros2 and self.ros2 is not None:
            self.ros2.await_change(lambda: self.stop.is_requested)
        elif self._ros2:
            from cellwright.middleware.ros2.host import Ros2
            from cellwright.middleware.ros2.host.ros2 import CELL_NODE

            self.ros2 = (self.ros2_keeper or opened).enter_context(
                Ros2(
                    self.notice,
                    lambda: self.stop.is_requested,
                    node=CELL_NODE if target.identity in (None, SIMULATOR) else target.identity.node,
                    others=target.controller_names,
                    options=None if self._ros2 is True else self._ros2,
                )
            )
        target.open(self)
        self.node = target.node
        opened.callback(target.close)
        if self._serve:
            self._open_server(self._serve, opened)

    def _open_server(self, options: ServerOptions, opened: ExitStack) -> None:
        from cellwright.middleware.server import Server

        server = Server(self.node, host=options.host, port=options.port, lockstep=self.lockstep, report=self.notice)
        self.server = server
        opened.callback(self._close_page)  # closed last: it reports that the run is over
        opened.callback(lambda: server.close(self._closing_reason()))
        opened.callback(self.target.close)  # closed first: it may answer what clients wait for
        if not server.is_local:
            self.report(
                f"{options.host}: open to the network; every program that reaches this machine can {self.target.acts}"
            )
        self.target.offer(self)
        if self._view:
            self.page = open_page(
                reachable_address(server.address), self._view, self.title, self.on_message, key=server.key
            )

    def _close_page(self) -> None:
        if self.page is not None:
            self.page.close()

    def _closing_reason(self) -> str:
        if self.stop.reason == WORLD_CHANGE:
            return WORLD_CHANGE
        if self.result is None or not self.target.runs_from_start:
            return self.target.stopped
        return f"the run is over: {self.result.outcome}"

    @property
    def title(self) -> str:
        """Title of the page."""
        return f"{self.node.name} · Cellwright"

    @property
    def address(self) -> tuple[str, int] | None:
        """Host and port of the server; None if there is none."""
        return None if self.server is None else self.server.address

    @property
    def url(self) -> str | None:
        """Address of the page; None if there is none."""
        return None if self.page is None else self.page.url

    def run(
        self, program: Agent | type[Agent] | Program | str | None = None, *, until: float | None = None
    ) -> SessionResult:
        """Let time pass until the run is over.

        Args:
            program: works a cell: an object with a method `run(client)`, its class, the name of a bundled agent,
                `"path.py:Class"`, or a `Program`. None: no agent here; the run lasts until `until` or a request to
                stop.
            until: stop at this simulation time [s], if nothing else comes before.

        Returns:
            The result; of a cell a `RunResult`. It holds what an agent raises.

        Raises:
            AgentError: there is no such agent, or it cannot be made.
            UsageError: there is neither a program, nor clients, nor a time to stop at.
        """
        if self.node is None:
            with self:
                return self.run(program, until=until)
        has_end = until is not None or self.stop.deadline != NEVER or self.target.has_end
        if program is None and self.server is None and not has_end:
            raise UsageError("until: a run without an agent needs an end; pass a time, such as until=10.0")
        if program is not None and not isinstance(self.node, Cell):
            raise UsageError("program: an agent needs a cell; for a robot use session.client()")
        if isinstance(program, str | type):
            program = find_agent(program)() if isinstance(program, str) else maker_of(program.__qualname__, program)()
        with ExitStack() as run:
            self._begin(run, until, has_agent=program is not None and not isinstance(program, Program))
            if program is None:
                outcome, error = self.target.loop(self)
            elif isinstance(program, Program):
                outcome, error = program.work(self)
            else:
                outcome, error = work_in_process(program, self.node, self.transport("/agent"))
            result = self._end(outcome, error)
        if (
            self.page is not None
            and self.server is not None
            and self.target.runs_from_start
            and not self.restart_requested
        ):
            self.server.wait(_LAST_POLL, until_request=False)
        return result

    def client(self, node: str = "/client") -> NodeClient:
        """Return a client in this process; time passes in its `sleep` and `wait_until`, and observers follow.

        Args:
            node: its node name, as the cell or the robot sees it.

        Returns:
            A `Client` of a cell, or a `NodeClient` of a robot.
        """
        if self._run is None:
            self._run = ExitStack()
            self._begin(self._run, None, has_agent=True)
        return (Client if isinstance(self.node, Cell) else NodeClient)(self.transport(node))

    def transport(self, node: str) -> InProcess:
        """Return a connection to the node for a client in this process."""
        transport = InProcess(self.node, node=node, stop=self.stop)
        if self._is_paced or self.server is not None:
            transport.step = lambda: self.loop.tick()  # a reset brings another loop
        else:
            transport.step = self.node.simulation.step
        return transport

    def _begin(self, run: ExitStack, until: float | None, *, has_agent: bool) -> None:
        if self.restart_requested:
            self.stop.withdraw()
        self._limit_time(until)
        self.restart_requested, self._is_over = False, False
        self.number += 1
        self.loop = SimulationLoop(
            self.node.simulation,
            self.server,
            rate=self.rate,
            stop=self.stop,
            on_poll=self._poll,
            can_wait=self.target.can_wait,
        )
        self.target.begin(self, run)
        self._has_agent, self._first_tick = has_agent, self.node.simulation.clock.tick
        simulation = self.node.simulation
        subscribe(simulation.on_rewind, lambda _time: self._limit_time(until), run)
        if self._files():
            subscribe(simulation.rewind_refusals, lambda: _ONE_COURSE, run)
        for observer in (*self._files(), *self.observers):
            run.enter_context(observer(self))
        is_there = not self.stop.is_requested
        if self.ros is not None and self.server is not None:
            if self.number == 1:
                is_there = self.ros.join(self.server.address, self.target.ros_parameters(), self.server.wait)
            self.on_poll.append(self.ros.poll)
            run.callback(self.on_poll.remove, self.ros.poll)
        if self.ros2 is not None and self.server is not None:
            if self.number == 1 and is_there:
                is_there = self.ros2.join(self.server.address, self.server.wait)
            self.on_poll.append(self.ros2.poll)
            run.callback(self.on_poll.remove, self.ros2.poll)
        if is_there:
            self._on_ready(self)
        self.loop.pacer.begin()
        self._begun = time.perf_counter()

    def _limit_time(self, until: float | None) -> None:
        """Let the run end at its own limits, and at `until` [s]."""
        self.stop.reset()
        if until is not None:
            self.stop.limit(nanoseconds(until))

    def _poll(self) -> None:
        for poll in self.on_poll:
            poll()

    def _files(self) -> list[Callable[[Session], AbstractContextManager[Any]]]:
        """Return the observers that write the requested files."""
        observers: list[Callable[[Session], AbstractContextManager[Any]]] = []
        if self.video is not None:
            observers.append(partial(take_video, options=self.video))
        if self.log is not None or self.options.log is not None:
            observers.append(keep_log)
        if self.record is not None:
            observers.append(partial(record_run, record=self.record))
        return observers

    def _end(self, outcome: str, error: str) -> SessionResult:
        result = self.result = self.target.result(self, outcome, error)
        self._is_over = True
        self.target.end(self, result)
        return result

    def result_by_now(self) -> SessionResult:
        """Return the result of the run so far."""
        return self.target.result(self, self.target.outcome_by_now(), "")

    def reset(
        self,
        *,
        keeps_clock: bool = False,
        seed: int | None = None,
        variation: bool | Bounds | None = None,
        joints: Mapping[str, float] | None = None,
    ) -> None:
        """Restart the run while clients stay connected; an agent in this process is run again.

        The run of a program's own `client()` ends, with its result and files, and another one begins: the client stays,
        and forgets the last run.

        Args:
            keeps_clock: message time goes on, so that clients see no jump; otherwise it restarts at 0.
            seed: root of all random streams of a cell; what is left out stays as it was, as for `Cell.reset`.
            variation: as for `Cell.reset`.
            joints: as for `Cell.reset`.

        Raises:
            RejectedCommandError: the clock cannot go on, see `state_refusal`.
            UsageError: a cell cannot start so, or this is no cell; the run goes on.

        Example:
            >>> import cellwright
            >>> with cellwright.Session("lesson") as session:
            ...     client = session.client()
            ...     for seed in (1, 2):
            ...         session.reset(seed=seed, variation=True)
            ...         client.sleep(0.1)
            >>> session.number, session.node.seed
            (3, 2)
        """
        if keeps_clock and (reason := self.state_refusal()):
            raise RejectedCommandError(reason)
        asked = {"seed": seed, "variation": variation, "joints": joints}
        start = {name: value for name, value in asked.items() if value is not None}
        self.target.check_start(start)
        self.target.start_next_with(start)
        if self._run is not None and not self._is_over and not self.loop.is_serving:
            self._run_again(self._run)
            return
        if self._restarts_as_whole:
            self.restart_requested = True
            self.stop.request("the run restarts")
            return
        simulation = self.node.simulation
        before, runs = simulation.now, simulation.runs
        self.target.reset(keeps_clock=keeps_clock)
        if simulation.runs != runs:
            self._first_tick = 0
            self.stop.reset()
            for listener in self.on_reset:
                listener(before)

    def _run_again(self, run: ExitStack) -> None:
        """End the run of a program's own client, and begin another one."""
        self.node.simulation.refuse_within_tick()
        with run:
            self._end(self.target.outcome_by_now(), "")
        self._run = ExitStack()
        self._begin(self._run, None, has_agent=True)

    def state_refusal(self) -> str:
        """Return why the run may not start again while the clock goes on; empty if it may."""
        return "the clock goes on in a run without an agent of this process only; use reset" * self._restarts_as_whole

    @property
    def _restarts_as_whole(self) -> bool:
        """True if a restart is a run of its own: none is under way, or it runs an agent."""
        return self.target.runs_from_start and (self.number == 0 or self._is_over or self._has_agent)

    def wait(self) -> bool:
        """Keep the page until it is closed, on request or until Ctrl-C; return whether to start the run again."""
        try:
            while (
                self.page is not None
                and self.page.is_running
                and not (self.restart_requested or self.stop.is_requested)
            ):
                assert self.server is not None
                self.server.wait(_POLL_PERIOD, until_request=False)
        except KeyboardInterrupt:
            return False
        return self.restart_requested


def open_page(
    address: tuple[str, int], options: PageOptions, title: str, on_message: Callable[[str], None], *, key: str = ""
) -> WebPage:
    """Open the page of a server at an address; `key` proves to the server that a request comes from the page.

    Raises:
        UsageError: the page cannot be opened.
    """
    from cellwright.viewer.web.start import page_source

    another = "" if key else f"{address[0]}:{address[1]}"
    return open_page_of(page_source(address, key), options, title, on_message, another=another)


def open_page_of(
    source: Mapping[str, Any],
    options: PageOptions,
    title: str,
    on_message: Callable[[str], None],
    *,
    another: str,
    **program: str,
) -> WebPage:
    """Open a page, and print its address.

    Args:
        source: what it shows, for its program.
        options: where it is.
        title: its title.
        on_message: receives lines about it.
        another: words of `cellwright view` that open another such page; empty if there are none.
        program: `program` of `WebPage`, unless it is that of a server's page.

    Raises:
        UsageError: the page cannot be opened.
    """
    from cellwright.viewer.web.start import WebPage

    def report_end() -> None:
        advice = f"; open another one with: cellwright view {another}" if another else ""
        on_message(f"the page has stopped{advice}")

    page = WebPage(
        source, host=options.host, port=options.port, token=options.token, title=title, on_gone=report_end, **program
    )
    on_message(f"page: {page.url}")
    if options.token:
        on_message(
            "the page is open to the network: this address gives access to everything that the page shows and controls"
        )
    if options.opens and not (has_desktop() and webbrowser.open(page.url)):
        on_message("no desktop found to open a browser on; open the address yourself")
    return page


def target_of(target: Any, *, seed: int | None = None, is_real_time: bool = False) -> Target:
    """Return the target for a session.

    Raises:
        UnknownNameError: there is no such trial, robot or file.
        UsageError: a trial and a robot share the name.
    """
    if isinstance(target, Target):
        return target
    if isinstance(target, Cell):
        return CellTarget(lambda: target)
    if isinstance(target, Trial):
        return CellTarget(lambda: Cell(target, seed=seed))
    if isinstance(target, list | tuple):
        return CellTarget(lambda: Cell(load_trial(target), seed=seed), lambda: find_files(target))
    if isinstance(target, str | Path):
        if Path(target).suffix.lower() in RECORDINGS:
            from cellwright.running.run.playback import PlaybackTarget

            return PlaybackTarget(Path(target))
        if not is_robot(target):
            return CellTarget(lambda: Cell(load_trial(target), seed=seed), lambda: find_files(target))
    from cellwright.running.run.robots import RobotTarget

    if isinstance(target, str | Path):
        return RobotTarget.of(lambda: load_robot(target), is_real_time=is_real_time)
    return RobotTarget.of(target, is_real_time=is_real_time)


def is_robot(word: str | Path) -> bool:
    """Return whether a name or a path is that of a robot; a name of neither counts as a trial's.

    Raises:
        UsageError: a trial has this name as well.
    """
    if word in bundled_robots():
        if word in bundled_trials():
            raise UsageError(f"{word}: names both a trial and a robot; give the path of a file")
        return True
    with suppress(CellwrightError, OSError, ValueError):  # loading it reports the errors
        return Path(word).is_dir() or is_robot_file(find_robot(word))
    return False
