from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.ros1.bridge.message_bytes import DeliveryCounter


@given(st.lists(st.sampled_from(["/a", "/b", "/c"])))
def test_delivery_counter_lists_topic_of_newest_message_last(topics: list[str]) -> None:
    sent = DeliveryCounter()
    for topic in ("/a", "/b", "/c"):
        sent.begin("/me", topic)
    for topic in topics:
        sent.count("/me", topic)
    found = sent.of("/me")
    assert dict(found) == {topic: topics.count(topic) for topic in ("/a", "/b", "/c")}
    last = {topic: max((i for i, each in enumerate(topics) if each == topic), default=-1) for topic, _ in found}
    assert list(last.values()) == sorted(last.values())
    assert sent.of("/you") == []


def test_delivery_counter_is_reset_by_connection_and_removed_at_end() -> None:
    sent = DeliveryCounter()
    sent.begin("/me", "/a")
    sent.count("/me", "/a")
    sent.begin("/me", "/a")
    assert sent.of("/me") == [("/a", 0)]
    sent.end("/me", "/a")
    sent.end("/me", "/a")
    assert sent.of("/me") == []
