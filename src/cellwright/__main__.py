"""The command line's way in: `cellwright`, and `python -m cellwright` where the command itself is not on the path."""

import errno
import sys
import threading

from cellwright.util.process import StandardStreams, end_despite_threads, interrupts_end_the_process

_NO_MEMORY = ("failed to map segment", "annot allocate memory", "ould not allocate memory")
"""How the loader of libraries and the engine say that there is no room."""


def main() -> int:
    """Run the command line; its exit status."""
    before = threading.enumerate()
    try:
        with interrupts_end_the_process():
            streams = StandardStreams()
            from cellwright.cli.main import main as run_command_line

        status = streams.status(run_command_line())
        end_despite_threads(before, status)
        return status
    except KeyboardInterrupt:  # between two lines of ours, where nobody waits for one
        sys.stderr.write("interrupted\n")
        return 1
    except Exception as error:
        if not (reason := _shortage(error)):
            raise
        sys.stderr.write(f"error: {reason}\n")
        return 1


def _shortage(error: Exception) -> str:
    """What this process may not have more of, and what to do; empty for any other error."""
    code = error.errno if isinstance(error, OSError) else None
    if code in (errno.EMFILE, errno.ENFILE):
        return "too many open files for this process; raise the limit (ulimit -n)"
    if isinstance(error, MemoryError) or code == errno.ENOMEM or any(text in str(error) for text in _NO_MEMORY):
        return "not enough memory for this process; raise the limit (ulimit -v) or free some"
    return ""


if __name__ == "__main__":
    sys.exit(main())
