"""Clients that measure: they run under the system's Python, each a function that brings all that it needs."""

from typing import Any


def measure_rates(topics: list[str], seconds: float) -> dict[str, dict[str, float]]:
    """How often topics speak, in simulation time.

    What is stale (the first message of each) does not count. Trays and frames are counted each for itself.

    Args:
        topics: full names; they have to be there.
        seconds: simulation time, from the moment at which all have spoken.

    Returns:
        For each topic its speakers ("node", or "node what") with messages a second.
    """
    import threading

    import rospy
    import rostopic
    from rosgraph_msgs.msg import Clock
    from tf2_msgs.msg import TFMessage

    now, heard, change = [0.0], {}, threading.Condition()  # type: ignore[var-annotated]

    def take_time(message: Any) -> None:
        with change:
            now[0] = message.clock.to_sec()
            change.notify_all()

    def take(message: Any, topic: str) -> None:
        whats = [""]
        if topic == "/ariac/trays":
            whats = [message.tray]
        elif topic == "/tf":
            whats = [transform.child_frame_id for transform in message.transforms]
        node = message._connection_header["callerid"]
        with change:
            for what in whats:
                heard.setdefault(topic, {}).setdefault(f"{node} {what}".strip(), []).append(now[0])

    rospy.init_node("meter", anonymous=True)
    rospy.Subscriber("/clock", Clock, take_time, tcp_nodelay=True)
    for topic in topics:
        # The raw bytes are enough, but where they have to be told apart.
        kind = TFMessage if topic == "/tf" else rospy.AnyMsg
        if topic == "/ariac/trays":
            kind = rostopic.get_topic_class(topic)[0]
        rospy.Subscriber(topic, kind, take, callback_args=topic, tcp_nodelay=True)
    with change:
        there = lambda: all(max(map(len, heard.get(topic, {"": []}).values())) > 1 for topic in topics)  # noqa: E731
        if not change.wait_for(there, 20.0):
            return {"silent": {topic: 0.0 for topic in topics if topic not in heard}}
        end = now[0] + seconds
        change.wait_for(lambda: now[0] >= end, 60.0)
        return {
            topic: {
                who: (len(times) - 2) / (times[-1] - times[1])
                for who, times in speakers.items()
                if len(times) > 2 and times[-1] - times[1] > seconds / 2
            }
            for topic, speakers in heard.items()
        }


def subscriber_headers(types: dict[str, str]) -> dict[str, list[dict[str, str]]]:
    """What those who subscribe to topics say when a publisher comes.

    Args:
        types: the type of each topic, by full name.
    """
    import time

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
    end = time.monotonic() + 10.0  # not by the clock of ROS, which may jump from 0 far ahead with the first message
    while time.monotonic() < end and not all(each.get_num_connections() for each in publishers):
        rospy.rostime.wallsleep(0.02)
    return said
