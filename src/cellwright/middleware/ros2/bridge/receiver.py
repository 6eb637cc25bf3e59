"""Thread that takes messages, requests and goals from ROS 2, in place of rclpy's executor."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.qos import HistoryPolicy, QoSProfile
from rclpy.waitable import NumberOfEntities

from cellwright.middleware.ros2.bridge.coroutines import GoalServer, run
from cellwright.middleware.wire.event_loop import nothing, report

Respond = Callable[[Any], None]
"""Sends the response to a request, from any thread."""

_MAX_TAKEN = 100  # messages of a topic in a row, so that a flood does not keep the others waiting

_MAX_REQUESTS = 1000  # of a service, until they are taken: of ROS's own 10, further ones replace the oldest unnoticed

_KINDS = ("subscriptions", "guard_conditions", "timers", "clients", "services", "events")


class _NotExecuted(CallbackGroup):  # type: ignore[misc]
    """Callback group whose callbacks no executor calls."""

    def can_execute(self, _entity: Any) -> bool:
        return False

    def beginning_execution(self, _entity: Any) -> bool:
        return False

    def ending_execution(self, _entity: Any) -> None:
        pass


class Receiver:
    """Thread that calls handlers of topics, services and actions; what it serves is advertised before `start`.

    For each message an executor of rclpy makes a task and collects all entities of its node several times, while other
    threads of Python stand still. With a cell's entities this takes longer than the way to the cell and back.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._group = _NotExecuted()
        self._end: Any = node.create_guard_condition(nothing, callback_group=self._group)
        self._is_ended = False
        self._subscriptions: list[tuple[Any, Callable[[Any, int], None]]] = []
        self._services: list[tuple[Any, Callable[[Any, Respond], None]]] = []
        self._actions: list[GoalServer] = []
        self._thread = threading.Thread(target=self._run, name="receiver", daemon=True)

    def subscribe(
        self, message_class: Any, name: str, take: Callable[[Any, int], None], qos: QoSProfile, *, raw: bool
    ) -> None:
        """Subscribe to a topic; `take` gets each message, or its bytes if `raw`, and its number of its publisher's."""
        subscription = self._node.create_subscription(
            message_class, name, nothing, qos, raw=raw, callback_group=self._group
        )
        self._subscriptions.append((subscription, take))

    def serve(self, service_class: Any, name: str, serve: Callable[[Any, Respond], None], *, node: Any = None) -> None:
        """Serve a service, of another node if given; `serve` gets each request, and the function that responds."""
        qos = QoSProfile(depth=_MAX_REQUESTS, history=HistoryPolicy.KEEP_LAST)
        create = (self._node if node is None else node).create_service
        service = create(service_class, name, nothing, qos_profile=qos, callback_group=self._group)
        self._services.append((service, serve))

    def offer(self, action_class: Any, name: str, execute: Callable[[Any], Any], **callbacks: Any) -> None:
        """Serve an action; `execute` and the callbacks are coroutines that await answers of `coroutines`."""
        self._actions.append(
            GoalServer(self._node, action_class, name, execute, callback_group=self._group, **callbacks)
        )

    def start(self) -> None:
        """Begin to call handlers."""
        self._thread.start()

    def close(self, timeout: float) -> None:
        """End the thread and the actions, before the node leaves the graph."""
        self._is_ended = True
        if self._thread.is_alive():
            self._end.trigger()
            self._thread.join(timeout)
        for action in self._actions:  # they would keep the node, and it its shared memory
            action.destroy()

    def _run(self) -> None:
        context = self._node.context.handle
        # Events, such as another quality of service, are waited for together with the messages. With the events in the
        # executor's set, messages came up to 13 ms late.
        events = [event for subscription, _ in self._subscriptions for event in subscription.event_handlers]
        waitables = [*events, *self._actions]
        own = NumberOfEntities(num_subs=len(self._subscriptions), num_gcs=1, num_services=len(self._services))
        counts = sum((each.get_num_entities() for each in waitables), own)
        waiting = rclpy_implementation.WaitSet(*(getattr(counts, f"num_{kind}") for kind in _KINDS), context)
        subscriptions = {each.handle.pointer: (each, take) for each, take in self._subscriptions}
        services = {each.handle.pointer: (each, serve) for each, serve in self._services}
        while not self._is_ended:
            waiting.clear_entities()
            waiting.add_guard_condition(self._end.handle)
            for subscription, _ in self._subscriptions:
                waiting.add_subscription(subscription.handle)
            for service, _ in self._services:
                waiting.add_service(service.handle)
            for waitable in waitables:
                waitable.add_to_wait_set(waiting)
            waiting.wait(-1)
            # Before services: commands come before steps.
            for pointer in waiting.get_ready_entities("subscription"):
                self._do(self._take, *subscriptions[pointer])
            for pointer in waiting.get_ready_entities("service"):
                if pointer in services:  # else it is of an action
                    self._do(self._answer, *services[pointer])
            for waitable in waitables:
                if waitable.is_ready(waiting):
                    self._do(self._handle, waitable)

    def _take(self, subscription: Any, take: Callable[[Any, int], None]) -> None:
        for _ in range(_MAX_TAKEN):
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if found is None:
                return
            take(found[0], found[1]["publication_sequence_number"])

    def _answer(self, service: Any, serve: Callable[[Any, Respond], None]) -> None:
        with service.handle:
            request, header = service.handle.service_take_request(service.srv_type.Request)
        if header is not None:
            serve(request, lambda response: service.send_response(response, header))

    def _handle(self, waitable: Any) -> None:
        run(waitable.execute(waitable.take_data()))

    def _do(self, function: Callable[..., None], *arguments: Any) -> None:
        """Call a function; a defect in it is no reason to leave the others uncalled."""
        try:
            function(*arguments)
        except Exception as defect:
            report(f"internal error, please report it: {type(defect).__name__}: {defect}")
