import json
from base64 import b64decode
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import Bus, Direction
from cellwright.middleware.messages.conversions import header, nanoseconds
from cellwright.middleware.messages.osrf_gear import Order, VacuumGripperState
from cellwright.middleware.messages.standard import Header, String
from cellwright.util.errors import UnknownNameError, UsageError


@pytest.fixture
def now() -> list[int]:
    """Simulation time [ns], as a list with one entry."""
    return [0]


@pytest.fixture
def bus(now: list[int]) -> Bus:
    return Bus(lambda: now[0])


def recorder(into: list[Any], name: str) -> Callable[[Any], None]:
    return lambda message: into.append((name, message.data))


def test_publish_delivers_in_order_of_subscription(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    heard: list[Any] = []
    for name in "abc":
        bus.subscribe("/state", recorder(heard, name))
    publisher.publish(String("1"))
    publisher.publish(String("2"))
    assert heard == [("a", "1"), ("b", "1"), ("c", "1"), ("a", "2"), ("b", "2"), ("c", "2")]


def test_publish_delivers_same_object_to_all_subscribers(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    heard: list[String] = []
    bus.subscribe("/state", heard.append)
    bus.subscribe("/state", heard.append)
    message = String("once")
    publisher.publish(message)
    assert heard[0] is heard[1] is message


def test_cancelled_subscription_gets_no_more_messages(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    heard: list[Any] = []
    first = bus.subscribe("/state", recorder(heard, "first"), node="/one")
    bus.subscribe("/state", recorder(heard, "second"), node="/two")
    assert publisher.listeners == 2
    assert bus.topic("/state").subscribers == ("/one", "/two")
    first.cancel()
    first.cancel()
    publisher.publish(String("x"))
    assert heard == [("second", "x")]
    assert bus.topic("/state").subscribers == ("/two",)


def test_callback_subscribed_twice_can_be_cancelled_once(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    heard: list[String] = []
    one = bus.subscribe("/state", heard.append)
    bus.subscribe("/state", heard.append)
    one.cancel()
    publisher.publish(String("x"))
    assert len(heard) == 1


def test_subscription_cancelled_during_delivery_gets_that_message_only(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    heard: list[Any] = []
    bus.subscribe("/state", lambda _message: last.cancel())
    last = bus.subscribe("/state", recorder(heard, "last"))
    publisher.publish(String("1"))
    publisher.publish(String("2"))
    assert heard == [("last", "1")]


def test_subscriber_before_advertise_gets_messages(bus: Bus) -> None:
    heard: list[Any] = []
    counts: list[int] = []
    bus.subscribe("/state", recorder(heard, "early"))
    assert bus.topics() == ()
    publisher = bus.advertise("/state", "std_msgs/String", on_listeners=counts.append)
    assert counts == [1]
    publisher.publish(String("x"))
    assert heard == [("early", "x")]


def test_latched_topic_gives_late_subscriber_newest_message(bus: Bus) -> None:
    publisher = bus.advertise("/orders", "osrf_gear/Order", latch=True)
    publisher.publish(Order("order_0"))
    publisher.publish(Order("order_1"))
    heard: list[Order] = []
    bus.subscribe("/orders", heard.append)
    assert heard == [Order("order_1")]
    publisher.publish(Order("order_2"))
    assert heard == [Order("order_1"), Order("order_2")]
    bus.forget_latched()
    later: list[Order] = []
    bus.subscribe("/orders", later.append)
    assert later == []


def test_unlatched_topic_gives_late_subscriber_nothing(bus: Bus) -> None:
    bus.advertise("/orders", "osrf_gear/Order").publish(Order("order_0"))
    heard: list[Order] = []
    bus.subscribe("/orders", heard.append)
    assert heard == []


def test_publishers_of_one_topic_latch_separately(bus: Bus) -> None:
    one = bus.advertise("/tf", "std_msgs/String", latch=True, node="/one")
    two = bus.advertise("/tf", "std_msgs/String", node="/two")
    three = bus.advertise("/tf", "std_msgs/String", latch=True, node="/three")
    for publisher in (three, two, one):
        publisher.publish(String(publisher.node))
    heard: list[Any] = []
    bus.subscribe("/tf", recorder(heard, ""))
    assert [text for _, text in heard] == ["/one", "/three"]
    assert bus.topic("/tf").publishers == ("/one", "/two", "/three")


def test_publisher_is_notified_of_each_listener_change(bus: Bus) -> None:
    counts: list[int] = []
    bus.advertise("/scan", "std_msgs/String", on_listeners=counts.append)
    one = bus.subscribe("/scan", lambda _message: None)
    two = bus.subscribe("/scan", lambda _message: None)
    one.cancel()
    one.cancel()
    two.cancel()
    assert counts == [1, 2, 1, 0]


def test_latched_topic_with_on_listeners_is_refused(bus: Bus) -> None:
    with pytest.raises(UsageError, match="/camera: a latched topic is published even without listeners"):
        bus.advertise("/camera", "std_msgs/String", latch=True, on_listeners=lambda _count: None)


def test_offered_message_is_built_once_when_needed(bus: Bus) -> None:
    publisher = bus.advertise("/camera", "std_msgs/String", latch=True)
    built: list[str] = []

    def offer(text: str) -> None:
        def build() -> String:
            built.append(text)
            return String(text)

        publisher.offer(build)

    offer("not needed")
    offer("newest")
    assert built == []
    heard: list[Any] = []
    for name in ("first", "second"):
        bus.subscribe("/camera", recorder(heard, name))
    assert (heard, built) == ([("first", "newest"), ("second", "newest")], ["newest"])
    offer("next")
    assert heard[2:] == [("first", "next"), ("second", "next")]
    assert built == ["newest", "next"]
    publisher.offer(lambda: None)
    assert heard[4:] == []


def test_subscriber_after_measurement_does_not_get_message(bus: Bus, now: list[int]) -> None:
    publisher = bus.advertise("/picture", "std_msgs/String")
    heard: list[Any] = []
    now[0] = 5
    bus.subscribe("/picture", recorder(heard, "early"))
    now[0] = 10
    bus.subscribe("/picture", recorder(heard, "late"))
    publisher.publish(String("a"), measured=6)
    publisher.publish(String("b"), measured=10)
    publisher.publish(String("c"), measured=11)
    assert heard == [("early", "a"), ("early", "b"), ("early", "c"), ("late", "c")]
    bus.forget_latched()  # time restarts: no listener is late
    publisher.publish(String("d"), measured=1)
    assert heard[4:] == [("early", "d"), ("late", "d")]


def test_latched_messages_survive_save_and_restore(bus: Bus) -> None:
    one = bus.advertise("/tf", "std_msgs/String", latch=True, node="/one")
    bus.advertise("/tf", "std_msgs/String", latch=True, node="/two")
    bus.advertise("/tf", "std_msgs/String", node="/three").publish(String("x"))
    assert bus.latched() == {}
    one.publish(String("kept"))
    state = json.loads(json.dumps(bus.latched()))
    one.publish(String("later"))
    heard: list[Any] = []
    bus.subscribe("/tf", recorder(heard, "before"))
    bus.set_latched(state)
    bus.subscribe("/tf", recorder(heard, "after"))
    assert heard == [("before", "later"), ("after", "kept")]
    bus.set_latched({})
    assert one.newest is None


def test_saved_text_is_that_of_the_newest_message_and_the_clock(bus: Bus) -> None:
    talk = bus.advertise("/talk", "std_msgs/Header", latch=True)

    def saved(offset: int = 0) -> int:
        (text,) = bus.latched(offset)["/talk"]
        assert text is not None
        return nanoseconds(bus.types.from_cdr(b64decode(text), Header).stamp)

    talk.publish(header("", 5))
    assert [saved(), saved(), saved(2), saved(2), saved()] == [5, 5, 3, 3, 5]
    talk.publish(header("", 7))
    assert [saved(2), saved()] == [5, 7]


def test_publish_in_on_listeners_reaches_new_subscriber(bus: Bus) -> None:
    heard: list[Any] = []
    publisher = bus.advertise(
        "/state", "std_msgs/String", on_listeners=lambda count: publisher.publish(String(str(count)))
    )
    bus.subscribe("/state", recorder(heard, "a"))
    assert heard == [("a", "1")]


def test_error_of_subscriber_propagates_from_publish(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")

    def fail(_message: String) -> None:
        raise ZeroDivisionError

    bus.subscribe("/state", fail)
    with pytest.raises(ZeroDivisionError):
        publisher.publish(String("x"))


def test_publish_of_other_message_class_is_refused(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    with pytest.raises(UsageError, match="/state carries std_msgs/String, not osrf_gear/VacuumGripperState"):
        publisher.publish(VacuumGripperState())


def test_topic_with_second_type_or_direction_is_refused(bus: Bus) -> None:
    bus.advertise("/state", "std_msgs/String")
    bus.advertise("/state", "std_msgs/msg/String")
    with pytest.raises(UsageError, match="/state is declared as output of std_msgs/String"):
        bus.advertise("/state", "osrf_gear/Order")
    with pytest.raises(UsageError, match="/state is already declared"):
        bus.listen("/state", "std_msgs/String", lambda _message, _node: None)
    bus.listen("/command", "std_msgs/String", lambda _message, _node: None)
    with pytest.raises(UsageError, match="/command is declared as input of std_msgs/String"):
        bus.advertise("/command", "std_msgs/String")
    with pytest.raises(UsageError, match="/command is already declared"):
        bus.listen("/command", "std_msgs/String", lambda _message, _node: None)
    with pytest.raises(UnknownNameError, match="unknown message"):
        bus.advertise("/other", "osrf_gear/Shipment")


@pytest.mark.parametrize("name", ["", "/", "orders", "ariac/orders", "/ariac/", "//orders", "/my orders", "/a\n"])
def test_name_that_is_not_absolute_is_refused(bus: Bus, name: str) -> None:
    with pytest.raises(UsageError, match="not an absolute name"):
        bus.subscribe(name, lambda _message: None)
    with pytest.raises(UsageError, match="not an absolute name"):
        bus.advertise(name, "std_msgs/String")
    with pytest.raises(UsageError, match="not an absolute name"):
        bus.serve(name, "std_srvs/Trigger", lambda _request, _node: None)


def test_topics_list_type_direction_and_nodes(bus: Bus) -> None:
    bus.advertise("/b", "std_msgs/String", latch=True, rate="10 Hz", node="/cell")
    bus.advertise("/b", "std_msgs/String", node="/other")
    bus.listen("/a", "osrf_gear/Order", lambda _message, _node: None, node="/cell")
    bus.subscribe("/b", lambda _message: None, node="/me")
    bus.subscribe("/a", lambda _message: None, node="/me")
    bus.subscribe("/not/there/yet", lambda _message: None)
    a, b = bus.topics()
    assert (a.name, a.type, a.direction, a.latch, a.rate) == ("/a", "osrf_gear/Order", Direction.IN, False, "")
    assert (a.publishers, a.subscribers) == ((), ("/cell", "/me"))
    assert (b.name, b.type, b.direction, b.latch, b.rate) == ("/b", "std_msgs/String", Direction.OUT, True, "10 Hz")
    assert (b.publishers, b.subscribers) == (("/cell", "/other"), ("/me",))
    assert bus.topic("/b") == b
    for unknown in ("/c", "/not/there/yet"):
        with pytest.raises(UnknownNameError, match=r"unknown topic .* \(known: /a, /b\)"):
            bus.topic(unknown)


@given(st.lists(st.one_of(st.just("subscribe"), st.integers(0, 9)), max_size=30))
def test_random_subscriptions_match_model(actions: list[Any]) -> None:
    """Compare with a model: subscriptions come and go, some cancelled twice; counts, order and delivery stay right."""
    bus = Bus(lambda: 0)
    counts: list[int] = []
    publisher = bus.advertise("/state", "std_msgs/String", on_listeners=counts.append)
    heard: list[Any] = []
    subscriptions: list[Any] = []

    def hear(number: int, _message: String) -> None:
        heard.append(number)

    alive: list[int] = []
    expected_counts: list[int] = []
    for action in actions:
        if action == "subscribe":
            number = len(subscriptions)
            subscriptions.append(bus.subscribe("/state", partial(hear, number)))
            alive.append(number)
            expected_counts.append(len(alive))
        elif action < len(subscriptions):
            subscriptions[action].cancel()
            if action in alive:
                alive.remove(action)
                expected_counts.append(len(alive))
        heard.clear()
        publisher.publish(String(""))
        assert heard == alive
        assert publisher.listeners == len(alive)
    assert counts == expected_counts


def test_subscription_with_origin_gets_messages_of_that_publisher_only(bus: Bus) -> None:
    changes: list[tuple[str, int]] = []
    arm, camera = (
        bus.advertise(
            "/frames",
            "std_msgs/String",
            node=node,
            on_listeners=lambda count, node=node: changes.append((node, count)),  # type: ignore[misc]
        )
        for node in ("/arm", "/camera")
    )
    heard: list[Any] = []
    bus.subscribe("/frames", recorder(heard, "both"))
    chosen = bus.subscribe("/frames", recorder(heard, "chosen"), node="/me", origin="/camera")
    assert (arm.listeners, camera.listeners, bus.topic("/frames").subscribers) == (1, 2, ("", "/me"))
    arm.publish(String("a"))
    camera.publish(String("c"))
    bus.subscribe("/frames", recorder(heard, "late"), origin="/arm")
    chosen.cancel()
    assert heard == [("both", "a"), ("both", "c"), ("chosen", "c")]
    assert changes == [("/arm", 1), ("/camera", 1), ("/camera", 2), ("/arm", 2), ("/camera", 1)]


def test_subscription_to_input_with_origin_gets_messages_of_that_sender_only(bus: Bus) -> None:
    bus.listen("/command", "std_msgs/String", lambda _message, _node: None)
    heard: list[Any] = []
    bus.subscribe("/command", recorder(heard, "chosen"), origin="/me")
    for node in ("/me", "/you"):
        bus.publish("/command", String(node), node=node)
    assert heard == [("chosen", "/me")]


def test_passive_subscription_gets_messages_and_is_not_counted(bus: Bus) -> None:
    counts: list[int] = []
    received: list[Any] = []
    publisher = bus.advertise("/picture", "std_msgs/String", on_listeners=counts.append)
    quiet = bus.subscribe("/picture", received.append, passive=True)
    assert publisher.listeners == 0
    assert not any(counts)
    listening = bus.subscribe("/picture", lambda _: None)
    assert (publisher.listeners, counts[-1]) == (1, 1)
    publisher.publish(String("a"))
    listening.cancel()
    assert (publisher.listeners, counts[-1]) == (0, 0)
    quiet.cancel()
    assert received == [String("a")]
    assert max(counts) == 1


def test_measured_bytes_reach_no_later_listener(bus: Bus, now: list[int]) -> None:
    publisher = bus.advertise("/state", "std_msgs/String")
    taken: list[bytes] = []
    now[0] = 5
    bus.subscribe("/state", lambda _message: None, take_cdr=taken.append)
    assert not publisher.publish_cdr(lambda: b"old", lambda: String("old"), 5)
    assert publisher.publish_cdr(lambda: b"new", lambda: String("new"), 6)
    assert taken == [b"new"]


def test_latched_bytes_leave_message_to_be_built_for_late_listener(bus: Bus) -> None:
    publisher = bus.advertise("/state", "std_msgs/String", latch=True)
    taken: list[bytes] = []
    bus.subscribe("/state", lambda _message: None, take_cdr=taken.append)
    assert publisher.publish_cdr(lambda: b"bytes", lambda: String("built"), 0)
    heard: list[String] = []
    bus.subscribe("/state", heard.append)
    assert (taken, heard) == ([b"bytes"], [String("built")])
    assert not publisher.publish_cdr(lambda: b"bytes", lambda: String("again"), 1)
