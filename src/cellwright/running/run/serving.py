"""Server of a session, with its nodes of ROS and its page."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING

from cellwright.config.trial.trial import Trial
from cellwright.middleware.server import Server
from cellwright.running.run.options import Outputs, PageOptions, ServerOptions, reachable_address
from cellwright.running.run.pages import open_page
from cellwright.running.run.target import HasPanel, RosNamed, RunControls, Served, Target, subscribe
from cellwright.util.errors import UsageError

if TYPE_CHECKING:
    from cellwright.middleware.ros1.host import Ros1
    from cellwright.middleware.ros2.host import Ros2
    from cellwright.viewer.web.start import WebPage

_POLL_PERIOD = 0.1  # [s]
_LAST_POLL = 0.7  # [s]: a page gets its panel four times a second


class Serving:
    """Server of a session, with its nodes of ROS and its page; all are closed with the stack that they are opened on.

    Args:
        options: options of the server.
        target: target of the session.
        controls: controls of its time.
        outputs: receivers of lines for people.

    Attributes:
        server: serves the clients, once it is open.
        page: the page; None if there is none.
        ros1: the node of ROS 1; None if there is none.
        ros2: the node of ROS 2; None if there is none.
    """

    server: Server

    def __init__(self, options: ServerOptions, target: Target, controls: RunControls, outputs: Outputs) -> None:
        self.options = options
        self._target, self._controls, self._outputs = target, controls, outputs
        self._ros_names = target if isinstance(target, RosNamed) else None
        self.page: WebPage | None = None
        self.ros1: Ros1 | None = None
        self.ros2: Ros2 | None = None

    def prepare_ros(self, opened: ExitStack) -> None:
        """Ensure a master of ROS 1, and find ROS 2, before the target is opened, which may be slow.

        Raises:
            UsageError: there is no ROS, or the target is no node of it.
        """
        options, stop = self.options, self._controls.stop
        if not (options.ros1 or options.ros2):
            return
        from cellwright.cell.interface.rows import SIMULATOR
        from cellwright.middleware.ros1.host.ros1 import Ros1

        if (names := self._ros_names) is None:
            raise UsageError("ros: the target is no node of ROS; serve it without")
        identity = names.identity or SIMULATOR
        if options.ros1:
            self.ros1 = opened.enter_context(Ros1(self._outputs.note, lambda: stop.is_requested, identity=identity))
            self.ros1.prepare()
        if not options.ros2:
            return
        if (worlds := options.worlds) is not None and worlds.ros2 is not None:
            self.ros2 = worlds.ros2
            self.ros2.await_change(lambda: stop.is_requested)
            return
        from cellwright.middleware.ros2.host import Ros2
        from cellwright.middleware.ros2.host.ros2 import CELL_NODE

        self.ros2 = (opened if worlds is None else worlds.kept).enter_context(
            Ros2(
                self._outputs.note,
                lambda: stop.is_requested,
                node=CELL_NODE if identity is SIMULATOR else identity.node,
                others=names.controller_names,
                options=None if options.ros2 is True else options.ros2,
            )
        )

    def open(
        self,
        opened: ExitStack,
        reset: Callable[..., None],
        state_refusal: Callable[[], str],
        load_world: Callable[[Trial], None] | None,
        *,
        reason: Callable[[], str],
    ) -> None:
        """Open the server of the open target, and offer what viewers need.

        Args:
            opened: closes it.
            reset: restarts the run.
            state_refusal: returns why it may not start again while the clock goes on.
            load_world: starts another session with a trial; None if that is not possible.
            reason: returns the reason for the end of the server.

        Raises:
            UsageError: the port is taken.
        """
        options, target = self.options, self._target
        server = self.server = Server(
            target.node, host=options.host, port=options.port, lockstep=options.lockstep, report=self._outputs.note
        )
        # Closed last: it reports that the run is over.
        opened.callback(self._close_page)
        opened.callback(lambda: server.close(reason()))
        # Closed first: it may answer what clients wait for.
        opened.callback(target.close)
        if not server.is_local:
            self._outputs.report(
                f"{options.host}: open to the network; every program that reaches this machine can {target.acts}"
            )
        if isinstance(target, HasPanel):
            target.offer(Served(server, self._controls, reset, options.restart_refusal, state_refusal, load_world))

    def open_page(self, options: PageOptions) -> None:
        """Open the page of the server.

        Raises:
            UsageError: the page cannot be opened.
        """
        server, title = self.server, f"{self._target.node.name} · Cellwright"
        self.page = open_page(
            reachable_address(server.address), options, title, self._outputs.on_message, key=server.key
        )

    def let_page_poll(self) -> None:
        """Serve the page, if there is one, until it has the result of a run that is over."""
        if self.page is not None:
            self.server.wait(_LAST_POLL, until_request=False)

    def keep_page(self, is_left: Callable[[], bool]) -> None:
        """Serve the page, if there is one, until it is closed, `is_left()`, or Ctrl-C."""
        with suppress(KeyboardInterrupt):
            while self.page is not None and self.page.is_running and not is_left():
                self.server.wait(_POLL_PERIOD, until_request=False)

    def _close_page(self) -> None:
        if self.page is not None:
            self.page.close()

    def join_ros(self, run: ExitStack, on_poll: list[Callable[[], object]], *, is_first: bool) -> bool:
        """Join ROS in the first run, and look after the bridges in each.

        Returns:
            False if the session was stopped before everything was there.
        """
        is_there = not self._controls.stop.is_requested
        server, names = self.server, self._ros_names
        if self.ros1 is not None and names is not None:
            if is_first:
                is_there = self.ros1.join(server.address, names.ros_parameters(), server.wait)
            subscribe(on_poll, self.ros1.poll, run)
        if self.ros2 is not None:
            if is_first and is_there:
                is_there = self.ros2.join(server.address, server.wait)
            subscribe(on_poll, self.ros2.poll, run)
        return is_there
