import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.bus import Bus, Mailbox
from cellwright.middleware.messages.standard import String
from cellwright.util.errors import UsageError


def test_messages_wait_in_order_of_arrival() -> None:
    bus = Bus(lambda: 0)
    a, b = bus.advertise("/a", "std_msgs/String"), bus.advertise("/b", "std_msgs/String")
    mailbox = Mailbox(10)
    for topic in ("/b", "/a"):
        bus.subscribe(topic, mailbox.listener(topic))
    for publisher, text in ((a, "1"), (b, "2"), (a, "3")):
        publisher.publish(String(text))
    assert len(mailbox) == 3
    assert mailbox.take() == ("/a", String("1"))
    assert mailbox.empty() == [("/b", String("2")), ("/a", String("3"))]
    assert mailbox.take() is None
    assert mailbox.empty() == []


@given(st.integers(1, 5), st.lists(st.booleans(), max_size=40))
def test_the_oldest_is_dropped_and_counted(size: int, puts: list[bool]) -> None:
    """Each True puts, each False takes; against a plain list."""
    mailbox = Mailbox(size)
    waiting: list[int] = []
    dropped = 0
    for number, put in enumerate(puts):
        if put:
            mailbox.put("/t", String(str(number)))
            waiting.append(number)
            if len(waiting) > size:
                waiting.pop(0)
                dropped += 1
        else:
            taken = mailbox.take()
            expected = ("/t", String(str(waiting.pop(0)))) if waiting else None
            assert taken == expected
        assert (len(mailbox), mailbox.dropped) == (len(waiting), dropped)


def test_a_mailbox_has_room() -> None:
    with pytest.raises(UsageError, match="at least one"):
        Mailbox(0)
