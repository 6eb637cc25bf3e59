"""Tutorials: their commands and programs print what the pages show."""

import re
import shlex
import shutil
from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.cli.conftest import CommandLine, Ran
from tests.docs.pages import Command, File, Program, Step, missing, steps
from tests.support.quick_children import QUICK_AGENTS, QUICK_WORKERS
from tests.support.warm import WarmStart
from tests.support.workshop import install

ROOT = Path(__file__).parents[2]
CELLWRIGHT = (ROOT / "tests" / "support" / "small_pictures.py").read_text(encoding="utf-8")
"""The command, with pictures that take a tenth of a second to draw and not ten."""

PAGES = [
    "README.md",
    "docs/getting-started.md",
    "docs/find-parts.md",
    "docs/own-cell.md",
    "docs/agents.md",
    "docs/latency.md",
    "docs/look.md",
    "docs/tasks.md",
    "docs/trials.md",
    "docs/own-models.md",
    "docs/plugins.md",
    "docs/policy-servers.md",
    "docs/recording.md",
    "docs/replay.md",
    "docs/score.md",
    "docs/variation.md",
    "docs/video.md",
    "docs/motion.md",
    "docs/configuration.md",
    "docs/environments.md",
    "docs/evaluate.md",
    "docs/export.md",
    "docs/judges.md",
    "docs/class.md",
    "docs/kitter.md",
    "docs/serve.md",
    "docs/operate-cell.md",
    "docs/robots.md",
    "docs/robot-configuration.md",
    "docs/robot-safety.md",
    "docs/ee-poses.md",
    "docs/api.md",
]


CONTINUED = {"docs/evaluate.md": ("docs/compare.md", "docs/cluster.md", "docs/results.md")}
"""Pages that go on where another one ends, with its files."""


@QUICK_AGENTS
@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_tutorial_followed_prints_what_it_shows(
    name: str, tmp_path: Path, warm: WarmStart, cellwright: CommandLine
) -> None:
    taken = [step for page in (name, *CONTINUED.get(name, ())) for step in steps(ROOT / page)]
    if name == "docs/plugins.md":
        install(tmp_path)
    elif name in ("docs/environments.md", "docs/judges.md"):
        for module in ("cellwright_env/cellwright_env.py", "lerobot_env_cellwright/cellwright_vector.py"):
            shutil.copy(ROOT / "adapters" / module, tmp_path)
    elif (example := ROOT / "docs" / "examples" / Path(name).stem.replace("-", "_")).is_dir():
        shutil.copytree(example, tmp_path, dirs_exist_ok=True)
    assert any(isinstance(step, Command | Program) for step in taken)
    take(taken, tmp_path, warm, cellwright)


def take(taken: Iterable[Step], folder: Path, warm: WarmStart, cellwright: CommandLine) -> None:
    """Take the steps of a page in a folder, and compare what is printed with what it shows.

    Args:
        taken: the steps.
        folder: working folder of commands and programs.
        warm: runs them; their start is not what a page is about.
        cellwright: runs commands that start processes themselves, in this process, where those are forked.
    """
    for step in taken:
        match step:
            case File(file, text):
                (folder / file).parent.mkdir(exist_ok=True)
                (folder / file).write_text(text, encoding="utf-8")
            case Program(text):
                ran = warm.run(text, folder=folder)
                assert ran.returncode == 0, ran.stderr
            case Command(line, output, status):
                command, *arguments = shlex.split(line)
                assert command in ("cellwright", "python")
                if command == "python":  # a program of the page
                    forked = warm.run((folder / arguments[0]).read_text(encoding="utf-8"), folder=folder)
                    done = Ran(forked.returncode, forked.stdout, forked.stderr)
                elif arguments[0] == "eval" or "--over" in arguments:
                    done = cellwright(*arguments)
                else:
                    forked = warm.run(CELLWRIGHT, *arguments, folder=folder)
                    done = Ran(forked.returncode, forked.stdout, forked.stderr)
                assert done.status == status, f"{line}\n{done.out}{done.err}"
                shown = done.out + done.err if status else done.out  # pages leave progress and warnings out
                assert missing(output, shown) is None, f"{line}\n{shown}"


def test_missing_output_returns_first_absent_line() -> None:
    printed = "one\n\ntwo  3 s\nthree\n"
    assert missing(("one", "two  … s", "three"), printed) is None
    assert missing(("one", "…"), printed) is None
    assert missing(("…", "three"), printed) is None
    assert missing((), printed) is None
    assert missing(("one", "three"), printed) == "three"
    assert missing(("two",), printed) == "two"
    assert missing(("…", "four"), printed) == "four"
    assert missing(("one",), printed) == "no more lines, but there was 'two  3 s'"


@pytest.mark.parametrize("page", [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")], ids=lambda page: page.name)
def test_link_of_page_leads_to_existing_file(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#\s]+)[^)]*\)", page.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_picture_of_cell_is_small_png() -> None:
    data = (ROOT / "docs" / "images" / "cell.png").read_bytes()
    assert data.startswith(b"\x89PNG")
    assert len(data) <= 500_000  # as `cellwright run --snapshot` writes it
