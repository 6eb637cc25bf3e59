"""Clients that measure: self-contained functions that run under the system's Python."""

from typing import Any

from tests.support.waiting import TIMEOUT, has_publisher, wait_until


def count_messages(topics: list[str], seconds: int) -> dict[str, dict[str, int]]:
    """Advance time in a cell in lockstep, and count messages meanwhile.

    Args:
        topics: full names.
        seconds: simulation time.

    Returns:
        For each topic its publishers ("node", or "node subject") with their numbers of messages. Trays and frames are
        counted separately.
    """
    import threading

    import rospy
    import rostopic
    from cellwright_msgs.srv import Step
    from tf2_msgs.msg import TFMessage

    counts: dict[str, dict[str, int]] = {topic: {} for topic in topics}
    come = dict.fromkeys(topics, 0)
    lock = threading.Lock()

    def take(message: Any, topic: str) -> None:
        node, whats = message._connection_header["callerid"], [""]
        if topic == "/ariac/trays":
            whats = [message.tray]
        elif topic == "/tf":
            whats = [transform.child_frame_id for transform in message.transforms]
        with lock:
            for what in whats:
                who = f"{node} {what}".strip()
                counts[topic][who] = counts[topic].get(who, 0) + 1
            come[topic] += 1

    # No node on simulation time: it would wait for time that only it advances.
    rospy.init_node("meter", anonymous=True)
    subscribers = {}
    for topic in topics:
        # The raw bytes are enough, except where messages are counted separately.
        kind = TFMessage if topic == "/tf" else rospy.AnyMsg
        if topic == "/ariac/trays":
            kind = rostopic.get_topic_class(topic)[0]
        subscribers[topic] = rospy.Subscriber(topic, kind, take, callback_args=topic, tcp_nodelay=True)
    step = rospy.ServiceProxy("/cellwright/step", Step, persistent=True)
    step.wait_for_service(TIMEOUT)
    wait_until(
        lambda: all(has_publisher(each) for each in subscribers.values()),
        "connections",
        seen=lambda: {topic: has_publisher(each) for topic, each in subscribers.items()},
    )
    begin: dict[str, dict[str, int]] = {}
    for number in range(10 * seconds + 1):
        answer = step(rospy.Duration(0, 100_000_000), list(topics), [0] * len(topics))
        assert answer.success, answer.message
        sent = dict(zip(answer.topics, answer.sent))  # noqa: B905 - the Python of ROS may be an old one
        wait_until(
            lambda: all(come[topic] >= count for topic, count in sent.items() if topic != "/clock"),  # noqa: B023
            "messages",
            seen=lambda: (sent, come),  # noqa: B023
        )
        counts["/clock"] = {"/gazebo": sent["/clock"]}  # rospy reads it too, and delivers only the newest
        if number == 0:  # latched messages do not count
            begin = {topic: dict(speakers) for topic, speakers in counts.items()}
    return {
        topic: {who: count - begin[topic].get(who, 0) for who, count in speakers.items()}
        for topic, speakers in counts.items()
    }


def subscriber_headers(types: dict[str, str]) -> dict[str, list[dict[str, str]]]:
    """Return the headers of topics' subscribers for a new publisher.

    Args:
        types: the type of each topic, by full name.
    """
    import rospy
    from roslib.message import get_message_class
    from rospy.impl.tcpros_pubsub import TCPROSHandler

    said: dict[str, list[dict[str, str]]] = {topic: [] for topic in types}
    accept = TCPROSHandler.topic_connection_handler

    def watched(self: Any, sock: Any, address: Any, header: dict[str, str]) -> Any:
        said[header["topic"]].append(header)
        return accept(self, sock, address, header)

    TCPROSHandler.topic_connection_handler = watched
    rospy.init_node("publisher", anonymous=True)
    publishers = [rospy.Publisher(topic, get_message_class(kind), queue_size=1) for topic, kind in types.items()]
    wait_until(lambda: all(each.get_num_connections() for each in publishers), "connections", seen=lambda: said)
    return said
