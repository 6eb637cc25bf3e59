"""Policies in recordings: the reports of an episode, in their order."""

from cellwright.clients.policies.report import TOPIC
from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile


def policy_reports(recording: RecordingFile) -> list[str]:
    """Return the reports of the policy that a recorded run has asked, as JSON texts; none if there was none.

    Raises:
        RecordingError: the recording is damaged.
    """
    return [text for command in recording.commands() if (text := report_in(command))]


def report_in(command: Command) -> str:
    """Return the report that a command is; empty if it is another one.

    Raises:
        RecordingError: it cannot be decoded.
    """
    if command.kind is not InputKind.PUBLISH or command.name != TOPIC:
        return ""
    message = command.message()
    return message.data if isinstance(message, String) else ""
