"""Session of a cell, a robot controller node or a recording: it runs, serves, shows, records and films it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from cellwright.cell.variation import Bounds
from cellwright.clients.agents.agent import Agent, find_agent, maker_of
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.clients.client.session import NodeClient
from cellwright.engine.clock import NEVER, nanoseconds
from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import WORLD_CHANGE
from cellwright.running.run.agent_work import work_in_process
from cellwright.running.run.files import RunFiles, opened_origin
from cellwright.running.run.loading import AnyTarget, target_of
from cellwright.running.run.options import Outputs, PageOptions, RecordOptions, RunOptions, ServerOptions
from cellwright.running.run.result import SessionResult
from cellwright.running.run.state import RunState
from cellwright.running.run.target import Origin, Player, RealTime, Refereed, Restartable, RunControls
from cellwright.util.errors import RejectedCommandError, UsageError

if TYPE_CHECKING:
    from cellwright.middleware.server import Server
    from cellwright.running.run.serving import Serving
    from cellwright.viewer.web.start import WebPage

_NOT_OPEN = "the session is not open; use it in a `with` block"
_CLOSED = "the session is closed and its resources are released; make a new one"


class Program(ABC):
    """Program that works a session in place of an agent of a cell, such as an agent in a process of its own.

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
    def work(self, session: Session) -> tuple[str, str]:
        """Let time pass until the run is over.

        Returns:
            How the run ended, and the error in words; empty if there was none.
        """


class Session:
    """Session of a cell, a robot controller node or a recording: it runs, serves, shows, records, films and logs it.

    Its resources are open within a `with` block. A run of a cell starts at time 0; a session may have several runs.

    Example:
        >>> import cellwright
        >>> with cellwright.Session("lesson") as session:
        ...     session.run(until=0.1).simulated
        0.1

    Args:
        target: a trial or a robot, by its name or the path of its file; a recording (`run.mcap`); a `Trial`, `Cell`,
            `RobotConfig` or `RobotNode`.
        seed: seed of all random streams of a trial; None takes the trial's own.
        rate: simulated seconds a wall second, or a `RateControl`, which may change; None: as `options.speed`.
        serve: serve clients in other processes; the options hold the address, lockstep and ROS.
        view: show it on a page in a browser; the options hold the address.
        record: files to write of each run, by their suffixes: a recording (`run.mcap`, `run.bag`), a video (`run.mp4`),
            the log of a cell's events (`run.jsonl`); one, a list, or options. A second run has files of its own.
        options: further options of each run, such as a time to stop at.
        outputs: receivers of lines for people; None: warnings, and the address of the page on stdout.

    Attributes:
        node: the cell, the robot controller node, or the player of the recording; None before the session is open.
        rate: rate at which time passes.
        stop: stop condition of the run; `stop.request()` ends it from anywhere.
        loop: steps the simulation of the newest run.
        state: state of the newest run: its figures, and how its time passes.
        serving: the server with its nodes of ROS; None if there is none.
        on_poll: called about ten times a wall second while a run is paced or served.
        result: result of the newest run; None before.
        number: number of the newest run, from 1.
        restart_requested: True if a restart was requested, so that the run is run once more.

    Raises:
        UnknownNameError: there is no such trial, robot or file.
        UsageError: a trial and a robot share the name, the port is taken, or the page cannot be opened.
    """

    state: RunState

    def __init__(
        self,
        target: AnyTarget,
        *,
        seed: int | None = None,
        rate: float | RateControl | None = None,
        serve: bool | ServerOptions = False,
        view: bool | PageOptions = False,
        record: str | Path | Sequence[str | Path] | RecordOptions | None = None,
        options: RunOptions | None = None,
        outputs: Outputs | None = None,
    ) -> None:
        self.options, self.outputs = options or RunOptions(), outputs or Outputs()
        speed = self.options.speed if rate is None else rate
        self.target = target_of(target, seed=seed, is_real_time=speed == 1.0)
        self._referee = self.target if isinstance(self.target, Refereed) else None
        self._is_paced = speed is not None
        self.rate = speed if isinstance(speed, RateControl) else RateControl(speed)
        until = self.options.until
        self.stop = StopCondition(None if until is None else nanoseconds(until))
        self._serve = ServerOptions(port=0) if view and not serve else ServerOptions() if serve is True else serve
        self._view = PageOptions() if view is True else view
        self._record = record if isinstance(record, RecordOptions) else RecordOptions.of(record or ())
        self._origin = Origin()
        self._controls = RunControls(self.rate, self.stop, self.outputs.report)
        self.on_poll: list[Callable[[], object]] = []
        self.node: Any = None
        self.serving: Serving | None = None
        self.result: SessionResult | None = None
        self.number, self.restart_requested, self._is_open = 0, False, False
        self._own_run: ExitStack | None = None  # of a program's own client
        self._opened = ExitStack()

    def __enter__(self) -> Self:
        if self.node is not None:
            raise UsageError(f"session: {_CLOSED}")
        with ExitStack() as opened:
            self._open(opened)
            self._opened = opened.pop_all()
        self._is_open = True
        return self

    def __exit__(self, *_: object) -> None:
        self._is_open = False
        try:
            if self._own_run is not None:  # a client has let time pass
                with self._own_run:
                    self._end(self.state.outcome_by_now(), "")
        finally:
            self._opened.close()

    def _open(self, opened: ExitStack) -> None:
        target, serving = self.target, None
        self._files().refuse()
        if self._serve:
            from cellwright.running.run.serving import Serving  # slow to load

            serving = Serving(self._serve, target, self._controls, self.outputs)
            serving.prepare_ros(opened)
        self._origin = opened_origin(target, self._controls, is_recorded=bool(self._record.paths))
        self.node = target.node
        opened.callback(target.close)
        if serving is not None:
            worlds = serving.options.worlds
            load = None if worlds is None else partial(worlds.load, self)
            serving.open(opened, self.reset, self.state_refusal, load, reason=self._closing_reason)
            self.serving = serving
            if self._view:
                serving.open_page(self._view)

    def _closing_reason(self) -> str:
        if self.stop.reason == WORLD_CHANGE:
            return WORLD_CHANGE
        if self.result is None or self._referee is None:
            return self.target.stopped
        return f"the run is over: {self.result.outcome}"

    @property
    def server(self) -> Server | None:
        """Server of the clients; None if there is none."""
        return None if self.serving is None else self.serving.server

    @property
    def page(self) -> WebPage | None:
        """The page; None if there is none."""
        return None if self.serving is None else self.serving.page

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
            UsageError: there is neither a program, nor clients, nor a time to stop at; or the session is closed.
        """
        if self.node is None:
            with self:
                return self.run(program, until=until)
        self._refuse_unless_open("run")
        has_end = until is not None or self.stop.deadline != NEVER or isinstance(self.target, Player)
        if program is None and self.server is None and not has_end:
            raise UsageError("until: a run without an agent needs an end; pass a time, such as until=10.0")
        if program is not None and not isinstance(program, Program) and self._referee is None:
            raise UsageError("program: an agent needs a cell; for a robot use session.client()")
        if isinstance(program, str | type):
            program = find_agent(program)() if isinstance(program, str) else maker_of(program.__qualname__, program)()
        with ExitStack() as run:
            self._begin(run, until, has_agent=program is not None and not isinstance(program, Program))
            if program is None:
                outcome, error = self.state.pass_time()
            elif isinstance(program, Program):
                outcome, error = program.work(self)
            else:
                outcome, error = work_in_process(program, self.node, self.transport("/agent"))
            result = self._end(outcome, error)
        if self.serving is not None and self._referee is not None and not self.restart_requested:
            self.serving.let_page_poll()
        return self.result or result

    def client(self, node: str = "/client") -> NodeClient:
        """Return a client in this process; time passes in its `sleep` and `wait_until`, and observers follow.

        Args:
            node: its node name, as the cell or the robot sees it.

        Returns:
            A `Client` of a cell, or a `NodeClient` of a robot.

        Raises:
            UsageError: the session is not open.
        """
        self._refuse_unless_open("client")
        if self._own_run is None:
            self._own_run = ExitStack()
            self._begin(self._own_run, None, has_agent=True)
        return (NodeClient if self._referee is None else Client)(self.transport(node))

    def transport(self, node: str) -> InProcess:
        """Return a connection to the node for a client in this process."""
        transport = InProcess(self.node, node=node, stop=self.stop)
        if self._is_paced or self.server is not None:
            transport.step = lambda: self.loop.tick()  # a reset brings another loop
        else:
            transport.step = self.node.simulation.step
        return transport

    def _refuse_unless_open(self, call: str) -> None:
        if not self._is_open:
            raise UsageError(f"{call}: {_NOT_OPEN if self.node is None else _CLOSED}")

    def _begin(self, run: ExitStack, until: float | None, *, has_agent: bool) -> None:
        if self.restart_requested:
            self.stop.withdraw()
        self.restart_requested = False
        self.number += 1
        server, files = self.server, self._files()
        self.loop = SimulationLoop(
            self.node.simulation,
            server,
            rate=self.rate,
            stop=self.stop,
            on_poll=self._poll,
            can_wait=not (isinstance(self.target, RealTime) and self.target.moves_real_robot()),
        )
        self.state = RunState(self.target, self.loop, files, until=until, has_agent=has_agent)

        def take_result() -> None:  # called last: each file adds to the result when it is closed
            self.result = files.result or self.result

        run.callback(take_result)
        is_paced = self.rate.speed is not None and not (server is not None and server.lockstep)
        self.state.begin(self.options, self.outputs, run, waits=not is_paced)
        for observer in self.options.observers:
            run.enter_context(observer(self))
        if self.serving is not None and self.serving.join_ros(run, self.on_poll, is_first=self.number == 1):
            self.serving.options.on_ready(self)
        self.state.begin_time()

    def _files(self) -> RunFiles:
        """Return the files of the newest run, not opened."""
        return RunFiles(self.target, self._record, self._origin, self.number, self.options.start, self.outputs.report)

    def _poll(self) -> None:
        for poll in self.on_poll:
            poll()

    def _end(self, outcome: str, error: str) -> SessionResult:
        self.result = self.state.end(outcome, error, restarts=self.restart_requested)
        return self.result

    def result_by_now(self) -> SessionResult:
        """Return the result of the run so far."""
        return self.state.result(self.state.outcome_by_now())

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
            UsageError: a cell cannot start so, or this is no cell; the run goes on. Or the session is not open.

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
        self._refuse_unless_open("reset")
        if keeps_clock and (reason := self.state_refusal()):
            raise RejectedCommandError(reason)
        asked = {"seed": seed, "variation": variation, "joints": joints}
        start = {name: value for name, value in asked.items() if value is not None}
        if self._referee is not None:
            self._referee.start_next_with(start)
        elif start:
            raise UsageError(f"reset: {', '.join(start)}: only a cell starts with them; leave them out")
        if self._own_run is not None and not self.state.is_over and not self.loop.is_serving:
            self._run_again(self._own_run)
            return
        if self._restarts_as_whole:
            self.restart_requested = True
            self.stop.request("the run restarts")
            return
        if not isinstance(self.target, Restartable):
            raise RejectedCommandError("the run cannot start again")
        simulation = self.node.simulation
        before, runs = simulation.now, simulation.runs
        self.target.reset(keeps_clock=keeps_clock)
        if simulation.runs != runs and self.number:
            self.state.restarted(before)

    def _run_again(self, run: ExitStack) -> None:
        """End the run of a program's own client, and begin another one."""
        self.node.simulation.refuse_within_tick()
        with run:
            self._end(self.state.outcome_by_now(), "")
        self._own_run = ExitStack()
        self._begin(self._own_run, None, has_agent=True)

    def state_refusal(self) -> str:
        """Return why the run may not start again while the clock goes on; empty if it may."""
        return "the clock goes on in a run without an agent of this process only; use reset" * self._restarts_as_whole

    @property
    def _restarts_as_whole(self) -> bool:
        """True if a restart is a run of its own: none is under way, or it runs an agent."""
        return self._referee is not None and (self.number == 0 or self.state.is_over or self.state.has_agent)

    def wait(self) -> bool:
        """Keep the page until it is closed, on request or until Ctrl-C; return whether to start the run again."""
        if self.serving is not None:
            self.serving.keep_page(lambda: self.restart_requested or self.stop.is_requested)
        return self.restart_requested
