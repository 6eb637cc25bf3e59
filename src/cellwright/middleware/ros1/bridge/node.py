"""ROS node of this process: start, clean end, size limits, its own subscriptions in the graph, and the master."""

from __future__ import annotations

import contextlib
import http.client
import os
import signal
import struct
import sys
import threading
import time
import xmlrpc.client
from typing import Any, Callable, Iterator
from urllib.parse import urlparse

import rosgraph
import rospy
import rospy.core
import rospy.impl.rosout
import rospy.names
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler
from rosgraph_msgs.msg import Log
from rospy.exceptions import TransportException
from rospy.impl.registration import Registration, get_topic_manager
from rospy.impl.tcpros_pubsub import TCPROSSub

from cellwright.middleware.wire.event_loop import MissingError, nothing, report
from cellwright.middleware.wire.frames import MAX_CLIENT_FRAME_BYTES
from cellwright.middleware.wire.graph import GraphGoneError

MAX_REQUEST_BYTES = 1 << 20  # longest request; those of nodes and masters have some hundreds of bytes

REQUEST_TIMEOUT = 120.0
"""Longest silence [s] of a connection; each has its own thread. Nodes leave theirs after half a minute."""

_LENGTH = struct.Struct("<I")
SIGN_OFF_TIMEOUT = 1.5  # limit of the sign-off [s], which usually takes some 10 ms
MASTER_TIMEOUT = 2.0  # time for the master to answer [s]
MASTER_PERIOD = 1.0  # time between two checks of it [s]
_LOOPBACK = ("localhost", "::1")
_RETRY = 0.25


def limit_requests() -> None:
    """Refuse requests that are too long or have no length, and close silent connections."""
    post = SilenceableXMLRPCRequestHandler.do_POST

    def do_post(self: SilenceableXMLRPCRequestHandler) -> None:
        length = self.headers.get("content-length", "")
        if length.isascii() and length.isdigit() and len(length) < 10 and int(length) <= MAX_REQUEST_BYTES:
            post(self)
            return
        self.close_connection = True  # else the rest would be read as another request
        self.send_error(413)

    SilenceableXMLRPCRequestHandler.do_POST = do_post
    SilenceableXMLRPCRequestHandler.timeout = REQUEST_TIMEOUT


def limit_messages(on_oversize: Callable[[str], None], max_bytes: int = MAX_CLIENT_FRAME_BYTES) -> None:
    """Reset connections that announce a message of more bytes than `max_bytes`.

    Threads of rospy call `on_oversize` with the name of the topic.
    """
    read = TCPROSSub.read_messages

    def read_messages(self: Any, buffer: Any, messages: Any, connection: Any) -> None:
        with buffer.getbuffer() as view:
            (length,) = _LENGTH.unpack_from(view)
        if length > max_bytes:
            buffer.seek(0)
            # Otherwise its bytes would be read as the next handshake.
            buffer.truncate()
            on_oversize(self.resolved_name)
            raise TransportException(f"a message of {length} bytes is too long")
        read(self, buffer, messages, connection)

    TCPROSSub.read_messages = read_messages


class ManagedTopic:
    """One side of a topic, `Registration.PUB` or `Registration.SUB`, as rospy's topic manager knows it."""

    def __init__(self, kind: str, name: str, type_name: str) -> None:
        self._kind = kind
        self.resolved_name = self.name = name
        self.type = type_name
        self.ref_count = 1

    def register(self) -> None:
        """Register it with the master."""
        manager = get_topic_manager()
        manager._add(self, manager.pubs if self._kind == Registration.PUB else manager.subs, self._kind)

    def check(self) -> None:
        """Do nothing: rospy calls this twice a second to find dead connections, but the loop detects them."""

    def close(self) -> None:
        """Do nothing: rospy calls this at the node's end, and the connections end with the process."""


class OwnSubscription(ManagedTopic):
    """Subscription to a topic of the node itself: part of the graph, but without a connection."""

    def __init__(self, name: str, type_name: str) -> None:
        super().__init__(Registration.SUB, name, type_name)

    def has_connection(self, _uri: str) -> bool:
        """Return True: no connection to a publisher is needed."""
        return True

    def get_stats_info(self) -> list[Any]:
        """Return both ends of the missing connection, as a C++ node reports it for its own topics."""
        within = ("INTRAPROCESS", self.name, True, "")
        return [(0, rospy.core.get_node_uri(), "i", *within), (0, rospy.get_name(), "o", *within)]

    def get_stats(self) -> Any:
        """Return the statistics of no connections."""
        return self.name, []


class StoppedError(BaseException):
    """A signal came before there was a loop to stop."""


def stop_by_exception() -> None:
    """Let SIGINT and SIGTERM raise a StoppedError, until `stop_by` is called."""

    def stop(_number: int, _frame: Any) -> None:
        raise StoppedError

    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, stop)


@contextlib.contextmanager
def stop_deferred() -> Iterator[None]:
    """Defer the StoppedError of SIGINT and SIGTERM to the end of the block; then `stop_by_exception`.

    It is for calls of rospy: an exception during a registration leaves rospy's connection to the master unusable, so
    that nothing can be unregistered. If the block hangs, the process ends after `SIGN_OFF_TIMEOUT`.
    """
    came: list[bool] = []

    def take() -> None:
        came.append(True)
        signal.setitimer(signal.ITIMER_REAL, SIGN_OFF_TIMEOUT)

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

    The node uses wall time: the bridge needs no other, and a subscription to /clock would show in the graph.
    """
    threading.excepthook = _thread_failed
    limit_requests()
    # Python's own 5 ms would add to the latency of messages.
    sys.setswitchinterval(0.0005)
    namespace, _, base = name.rpartition("/")
    # Instead of ROS_NAMESPACE at rospy's import.
    rospy.names._set_caller_id(f"{namespace}/unnamed")
    with stop_deferred():
        rospy.init_node(base, argv=[sys.argv[0]], disable_signals=True, disable_rostime=True)


def log_to_rosout(line: str) -> None:
    """Publish a warning on /rosout; rospy's own functions would also print it."""
    publisher = rospy.impl.rosout._rosout_pub
    if publisher is not None:
        message = Log(level=Log.WARN, name=rospy.get_name(), msg=line)
        message.header.stamp = rospy.Time.now()
        publisher.publish(message)


def run_process(
    serve: Callable[[], int], *, before: Callable[[], None] = nothing, after: Callable[[], None] = nothing
) -> None:
    """Serve until the end, sign off at the master and end the process in any case.

    rospy leaves waiting threads behind; the process does not wait for them.

    Args:
        serve: returns the exit status. It is 0 after a signal, and 1 if something is missing.
        before: called when `serve` has ended.
        after: called when the node has signed off.
    """
    status = 1
    try:
        stop_by_exception()
        status = serve()
    except (MissingError, rospy.ROSInitException) as error:
        report(str(error))
    except StoppedError:
        status = 0
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    watchdog = threading.Timer(SIGN_OFF_TIMEOUT, os._exit, [status])
    watchdog.daemon = True
    watchdog.start()
    sys.stderr.flush()
    sys.stderr = open(os.devnull, "w")  # noqa: SIM115 - what threads say of connections that break now is no news
    before()
    # rospy is shut down once it has signed off; then it would wait half a second for its own threads
    threading.Thread(target=rospy.core.signal_shutdown, args=["the bridge ends"], daemon=True).start()
    end = time.monotonic() + SIGN_OFF_TIMEOUT
    while not rospy.core.is_shutdown() and time.monotonic() < end:
        time.sleep(0.005)
    after()
    os._exit(status)


def _thread_failed(arguments: Any) -> None:
    """Report a thread's error in one line; its traceback goes to the log."""
    error = arguments.exc_value
    rospy.core.rospyerr("a thread has failed", exc_info=(type(error), error, arguments.exc_traceback))
    report(f"connection failed: {type(error).__name__}: {error}")


class MasterGoneError(GraphGoneError):
    """The master does not answer; the text has its address."""


class Master:
    """The environment's master; calls raise a MasterGoneError if it takes too long to answer, or does not."""

    def __init__(self, node: str) -> None:
        self.uri: str = rosgraph.get_master_uri()
        self._node = node
        self._server = xmlrpc.client.ServerProxy(self.uri, transport=_TimeoutTransport())

    def ask(self, method: str, *arguments: Any) -> Any | None:
        """Call a method of the master's API; return its value, None if it fails."""
        try:
            code, _, value = getattr(self._server, method)(self._node, *arguments)
        except (OSError, http.client.HTTPException, xmlrpc.client.Error, ValueError, TypeError) as error:
            raise MasterGoneError(f"no ROS master answers at {self.uri}: {error}") from None
        return value if code == 1 else None

    def wait(self, timeout: float) -> None:
        """Wait until it answers, for `timeout` [s] at most."""
        end = time.monotonic() + timeout
        while True:
            try:
                self.ask("getPid")
                return
            except MasterGoneError:
                if time.monotonic() > end:
                    raise
            time.sleep(_RETRY)

    def knows(self, node: str, *, publishes: str, hears: str) -> bool:
        """True if a node is registered as publisher of one topic and as subscriber of another."""
        state = self.ask("getSystemState")
        if state is None:
            return False
        publishers, subscribers = dict(state[0]), dict(state[1])
        return node in publishers.get(publishes, ()) and node in subscribers.get(hears, ())

    def sign_off(self) -> None:
        """Remove all registrations of the node, whose process has ended; it may have left some."""
        uri, state = self.ask("lookupNode", self._node), self.ask("getSystemState")
        if uri is None or state is None:
            return
        publishers, subscribers, services = ([name for name, nodes in role if self._node in nodes] for role in state)
        for name in publishers:
            self.ask("unregisterPublisher", name, uri)
        for name in subscribers:
            self.ask("unregisterSubscriber", name, uri)
        for name in services:
            self.ask("unregisterService", name, self.ask("lookupService", name) or "")


class MasterWatch:
    """Watch of the master in its own thread, for a node that should be registered there with its `uri`.

    `on_new` is called if the master does not know the node, and `on_replaced` if another node has its name.
    """

    def __init__(self, node: str, uri: str, on_new: Callable[[], None], on_replaced: Callable[[], None]) -> None:
        self._master = Master(node)
        self._node = node
        self._uri = uri
        self._on_new = on_new
        self._on_replaced = on_replaced
        threading.Thread(target=self._watch, name="master", daemon=True).start()

    def _watch(self) -> None:
        is_lost, failures = False, 0
        while True:
            time.sleep(_RETRY if failures else MASTER_PERIOD)
            try:
                known = self._master.ask("lookupNode", self._node)
            except MasterGoneError:
                failures += 1
                if failures > 1 and not is_lost:
                    is_lost = True
                    report(
                        f"the ROS master at {self._master.uri} is gone, with all parameters: new programs find no "
                        f"topics and no services; {self._node} and existing connections continue"
                    )
                continue
            if known is None:
                report(f"a new ROS master answers at {self._master.uri}: registering everything there")
                self._on_new()
                return
            if known.rstrip("/") != self._uri.rstrip("/"):
                self._on_replaced()
                return
            if is_lost:
                report(f"the ROS master at {self._master.uri} answers again and still knows all registrations")
            is_lost, failures = False, 0


def listen_on_loopback() -> None:
    """Listen on loopback only, if the master does and the environment names no other address."""
    environment = os.environ
    if any(environment.get(name) for name in ("ROS_IP", "ROS_HOSTNAME", "ROS_IPV6")):
        return
    host = urlparse(rosgraph.get_master_uri()).hostname or ""
    if host in _LOOPBACK or host.startswith("127."):
        environment["ROS_IP"] = "127.0.0.1"


class _TimeoutTransport(xmlrpc.client.Transport):
    """XML-RPC transport with a timeout."""

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = MASTER_TIMEOUT
        return connection
