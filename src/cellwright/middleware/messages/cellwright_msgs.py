"""Messages and services of cellwright_msgs, made of `definitions/cellwright_msgs`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from dataclasses import field

from cellwright.middleware.messages import conversions, standard
from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("cellwright_msgs/msg/TeleopStatus")
class TeleopStatus(MessageClass):
    """Status of a robot controller node: its source of commands, and counts of accepted and refused ones."""

    enabled: bool = True  # Whether commands are accepted at all.
    emergency_stop: bool = False  # Whether the emergency stop holds the robot.
    resetting: bool = False  # Whether the robot moves to its home posture.
    silent: bool = False  # Whether the robot holds because no command has arrived for too long.
    commander: str = ""  # The node whose commands are accepted; empty if there is none.
    # Commands accepted, refused and ignored (while resetting, stopped or not enabled, or for none of the robot's
    # joints).
    taken: int = 0
    refused: int = 0
    ignored: int = 0
    unknown_names: list[str] = field(default_factory=list)  # Names in commands that the robot does not have.
    message: str = ""  # The status in a sentence.


@message_class("cellwright_msgs/srv/Step_Request")
class StepRequest(MessageClass):
    """Advances time in a cell in lockstep. A caller may give the duration alone."""

    duration: standard.Duration = field(default_factory=conversions.duration)  # simulation time to advance
    topics: list[str] = field(default_factory=list)  # topics that the caller publishes or subscribes to
    # number of messages it has published on each; the step waits until all have arrived
    published: conversions.Counts = field(default_factory=conversions.counts)


@message_class("cellwright_msgs/srv/Step_Response")
class StepResponse(MessageClass):
    """Response of cellwright_msgs/Step."""

    success: bool = False  # whether time has advanced
    message: str = ""  # the result in words
    time: standard.Time = field(default_factory=conversions.stamp)  # simulation time at the end
    topics: list[str] = field(default_factory=list)  # topics on which the cell has sent messages
    # number of messages sent to the caller on each
    sent: conversions.Counts = field(default_factory=conversions.counts)
