"""Lines that set variables in the user's shell, for commands that are evaluated there."""

from __future__ import annotations

import os
import shlex
from collections.abc import Mapping

from cellwright.cli.options import refuse

SHELLS = ("sh", "fish")  # syntaxes of the lines; bash and zsh understand `sh` as well
SHELL_HELP = "Shell language: `sh` (bash, zsh) or `fish`."


def check_shell(shell: str) -> None:
    """Refuse a value of the option --shell that is none of `SHELLS`."""
    if shell not in SHELLS:
        refuse(f"--shell {shell}: give one of {', '.join(SHELLS)}")


def shell_lines(values: Mapping[str, str | None], shell: str) -> str:
    """Return lines that set variables, or unset those with None, for one of `SHELLS` to evaluate."""
    lines = []
    for name, value in values.items():
        if value is None:
            lines.append(f"set -e {name}" if shell == "fish" else f"unset {name}")
        elif shell == "fish":
            parts = value.split(os.pathsep) if name == "PATH" else [value]
            quoted = ("'" + part.replace("\\", "\\\\").replace("'", "\\'") + "'" for part in parts)
            lines.append(" ".join(["set -gx", name, *quoted]))
        else:
            lines.append(f"export {name}={shlex.quote(value)}")
    return "\n".join(lines)
