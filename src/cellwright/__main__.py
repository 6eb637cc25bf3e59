"""Entry point of the command line: the command `cellwright`, and `python -m cellwright` if that is not on the path."""

import errno
import sys
import threading

from cellwright.util.process import StandardStreams, exit_despite_threads, silent_ctrl_c

_INTERRUPTED = 130  # as in cli/main.py, which may not be loaded yet
_NO_MEMORY = ("failed to map segment", "annot allocate memory", "ould not allocate memory")
"""Parts of the messages in which the library loader and the engine report a lack of memory."""


def main() -> int:
    """Run the command line and return its exit status."""
    before = threading.enumerate()
    try:
        with silent_ctrl_c():
            streams = StandardStreams()
            from cellwright.cli.main import main as run_command_line

        status = streams.status(run_command_line())
        exit_despite_threads(before, status)
        return status
    except KeyboardInterrupt:  # between two lines of ours, where nothing else handles it
        sys.stderr.write("interrupted\n")
        return _INTERRUPTED
    except Exception as error:
        if not (reason := _shortage(error)):
            raise
        sys.stderr.write(f"error: {reason}\n")
        return 1


def _shortage(error: Exception) -> str:
    """Return the resource that this process lacks, and the remedy; empty for any other error."""
    code = error.errno if isinstance(error, OSError) else None
    if code in (errno.EMFILE, errno.ENFILE):
        return "too many open files for this process; raise the limit (ulimit -n)"
    if isinstance(error, MemoryError) or code == errno.ENOMEM or any(text in str(error) for text in _NO_MEMORY):
        return "not enough memory for this process; raise the limit (ulimit -v) or free some"
    return ""


if __name__ == "__main__":
    sys.exit(main())
