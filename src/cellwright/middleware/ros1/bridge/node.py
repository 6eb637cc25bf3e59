"""The ROS node that this process is: its beginning, and an end that is clean and short whatever hangs."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
import time
from typing import Any, Callable, Iterator

import rospy
import rospy.core
import rospy.names

from cellwright.middleware.ros1.bridge.report import report
from cellwright.middleware.ros1.bridge.requests import limit_requests

PATIENCE = 1.5
"""How long signing off may take [s]; it takes some 10 ms where nothing hangs."""


class StoppedError(BaseException):
    """A signal has come before there was a loop to stop."""


def stop_by_exception() -> None:
    """Let SIGINT and SIGTERM raise a StoppedError; until `stop_by` is called."""

    def stop(_number: int, _frame: Any) -> None:
        raise StoppedError

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)


@contextlib.contextmanager
def stop_deferred() -> Iterator[None]:
    """Let SIGINT and SIGTERM raise a StoppedError at the end of the block, and not within it; then `stop_by_exception`.

    For calls of rospy: an exception amid a registration leaves rospy's connection to the master unusable, and with it
    nothing can be taken back. Where the block hangs, the process ends after `PATIENCE`.
    """
    came: list[bool] = []

    def take() -> None:
        came.append(True)
        signal.setitimer(signal.ITIMER_REAL, PATIENCE)

    signal.signal(signal.SIGALRM, lambda _number, _frame: os._exit(0))
    stop_by(take)
    yield
    stop_by_exception()
    if came:
        raise StoppedError


def stop_by(function: Callable[[], None]) -> None:
    """Let SIGINT and SIGTERM call a function."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda _number, _frame: function())


def begin_node(name: str) -> None:
    """Become the node of an absolute name. The master must answer.

    Time stays the wall's: what carries messages has no use for another, and a subscription to /clock would show.
    """
    threading.excepthook = _thread_failed
    limit_requests()
    sys.setswitchinterval(0.0005)  # Python's own 5 ms would show in the time that a message takes
    namespace, _, base = name.rpartition("/")
    rospy.names._set_caller_id(f"{namespace}/unnamed")  # in place of what ROS_NAMESPACE said when rospy was loaded
    with stop_deferred():
        rospy.init_node(base, argv=[sys.argv[0]], disable_signals=True, disable_rostime=True)


def end_process(
    status: int, *, before: Callable[[], None] = lambda: None, after: Callable[[], None] = lambda: None
) -> None:
    """Sign off at the master and end the process with a status, however that goes.

    rospy leaves threads behind that wait for others; nothing is waited for here.

    Args:
        status: exit status.
        before: called first.
        after: called when the node has signed off.
    """
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    watchdog = threading.Timer(PATIENCE, os._exit, [status])
    watchdog.daemon = True
    watchdog.start()
    sys.stderr.flush()
    sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - what threads say of connections that break now is no news
    before()
    # rospy says that it is shut down once it has signed off; then it would wait half a second for threads of its own
    threading.Thread(target=rospy.core.signal_shutdown, args=["the bridge ends"], daemon=True).start()
    end = time.monotonic() + PATIENCE
    while not rospy.core.is_shutdown() and time.monotonic() < end:
        time.sleep(0.005)
    after()
    os._exit(status)


def _thread_failed(arguments: Any) -> None:
    """One line in place of a traceback, which goes to the log."""
    error = arguments.exc_value
    rospy.core.rospyerr("a thread has failed", exc_info=(type(error), error, arguments.exc_traceback))
    report(f"a connection has failed: {type(error).__name__}: {error}")
