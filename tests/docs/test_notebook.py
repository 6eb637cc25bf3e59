"""A page for terminals becomes cells that each say what its terminal would remember."""

import subprocess
from pathlib import Path
from typing import Any

from tests.docs.notebook import LIMIT, Cell, as_output, cells, document, printed
from tests.docs.pages import Command, pieces

PAGE = """# Title

To begin with:

<!-- file: a/b.txt -->
```text
hello
```

<!-- terminal: one -->
```console
$ cd a
$ source ~/setup.sh
$ cat b.txt
hello
$ ls
$ cd ..
$ serve --all
…
ready: port …
…
```

Elsewhere:

<!-- terminal: two -->
```console
$ ask
yes
```

<!-- terminal: one -->
```console
…
asked
```

<!-- terminal: one -->
```console
^C
bye
$ ls
…
```

```sh
only for reading
```
"""


def waited_for(sign: str) -> str:
    return f"timeout {LIMIT} sh -c 'until grep -q {sign} ~/terminal-one.log; do sleep 0.2; done'"


def test_cell_restores_state_of_its_terminal() -> None:
    made = cells(PAGE)
    code = [cell.source for cell in made if cell.is_code][1:]
    assert code[0] == "%%writefile ~/a/b.txt\nhello"
    assert made[3] == Cell("%%bash\nsource ~/setup.sh\ncd a\nset -e\ncat b.txt\nls", True, ("hello", "…"))
    started = code[2].splitlines()
    assert started[:4] == ["%%bash", "source ~/setup.sh", "cd ..", "set -e"]
    emptied, running = (
        next(number for number, line in enumerate(started) if line.startswith(begin))
        for begin in (": > ~/terminal-one.log", "serve --all &> ~/terminal-one.log &")
    )
    assert emptied < running, "what an earlier program printed there would be taken for the sign"
    assert waited_for("'\"'\"'ready: port'\"'\"'") in started
    assert code[3] == "%%bash\nset -e\nask"
    looked = f"%%bash\n{waited_for('asked')}\ncat ~/terminal-one.log"
    assert made[-4] == Cell(looked, True, ("…", "asked"))
    assert "kill -INT -- -$pid" in code[5]
    assert code[6].endswith("set -e\nls")
    assert [cell.source for cell in made if not cell.is_code] == [
        "# Title\n\nTo begin with:",
        "Elsewhere:",
        "```sh\nonly for reading\n```",
    ]


def test_command_with_later_output_keeps_running() -> None:
    commands = [step for piece in pieces(PAGE) if not isinstance(piece, str) for step in piece]
    going = [step.line for step in commands if isinstance(step, Command) and step.goes_on]
    assert going == ["serve --all", ""]


def test_program_in_cells_is_started_watched_and_interrupted(tmp_path: Path) -> None:
    page = """Begin.

<!-- terminal: one -->
```console
$ sh -c "trap 'echo bye; exit 0' INT; echo ready: now; while :; do sleep 0.1; done"
ready: …
```

<!-- terminal: one -->
```console
^C
…
bye
```
"""
    code = [cell for cell in cells(page) if cell.is_code][1:]
    output = ""
    for cell in code:
        script = cell.source.removeprefix("%%bash\n")
        ran = subprocess.run(
            ["bash", "-c", script],
            env={"PATH": "/usr/bin:/bin", "HOME": str(tmp_path)},
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
        )
        assert ran.returncode == 0, ran.stderr
        output += ran.stdout
    assert output == "ready: now\nready: now\nbye\n"


def test_output_is_stored_without_colours_and_local_folders() -> None:
    made = [Cell("words"), Cell("1", is_code=True)]
    outputs: list[dict[str, Any]] = [{"text": ["\x1b[1mat /tmp/x/home\x1b[0m/a\n"]}, {"text": "b\n"}]
    kept = as_output(printed(outputs), {"/tmp/x/home": "/home/you"})
    notebook = document(made, {1: kept})
    assert notebook["cells"][0]["cell_type"] == "markdown"
    assert notebook["cells"][1]["outputs"] == kept
    assert printed(kept) == "at /home/you/a\nb\n"


def test_cell_ids_are_unique() -> None:
    ids = [cell["id"] for cell in document(cells(PAGE))["cells"]]
    assert len(set(ids)) == len(ids)
