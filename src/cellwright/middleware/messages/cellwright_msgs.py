"""Messages and services of cellwright_msgs, made of `definitions/cellwright_msgs`.

Generated: change the definitions, and run `python -m tools.message_classes`.
"""

from dataclasses import field

from cellwright.middleware.messages import conversions, standard
from cellwright.middleware.messages.message_class import MessageClass, message_class


@message_class("cellwright_msgs/msg/TeleopStatus")
class TeleopStatus(MessageClass):
    """What a robot controller node takes commands from, and what it refused."""

    enabled: bool = True  # Whether commands are taken at all.
    emergency_stop: bool = False  # Whether the emergency stop holds the robot.
    resetting: bool = False  # Whether the robot is on its way home.
    silent: bool = False  # Whether the robot holds because nothing has come for too long.
    commander: str = ""  # The node whose commands are taken; empty when there is none.
    # Commands taken, commands refused, and commands ignored (while resetting, stopped or not enabled, or for none of
    # the robot's joints).
    taken: int = 0
    refused: int = 0
    ignored: int = 0
    unknown_names: list[str] = field(default_factory=list)  # Names that commands gave and the robot does not have.
    message: str = ""  # What there is to say, in a sentence.


@message_class("cellwright_msgs/srv/Step_Request")
class StepRequest(MessageClass):
    """Lets time pass in a cell that is in lockstep. A caller may give the duration alone."""

    duration: standard.Duration = field(default_factory=conversions.duration)  # how much simulation time is to pass
    topics: list[str] = field(default_factory=list)  # topics that the caller publishes to, or listens to
    # how many messages it has published on each of them; the step waits for all to have come
    published: conversions.Counts = field(default_factory=conversions.counts)


@message_class("cellwright_msgs/srv/Step_Response")
class StepResponse(MessageClass):
    """Response of cellwright_msgs/Step."""

    success: bool = False  # whether the time has passed
    message: str = ""  # how it went, for people
    time: standard.Time = field(default_factory=conversions.stamp)  # simulation time at the end
    topics: list[str] = field(default_factory=list)  # topics that the cell has sent something on
    # how many messages the caller was sent on each of them
    sent: conversions.Counts = field(default_factory=conversions.counts)
