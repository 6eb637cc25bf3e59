"""Tests of `cellwright replay --verify`: the run repeats exactly, from the recording alone."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from cellwright.cli.main import main
from cellwright.cli.replay.actions import show_verdict
from cellwright.config.trial.catalogue import find_trial
from cellwright.recording.format.format import RecordingHeader
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import TickTime, VerificationResult, versions_that_differ
from cellwright.util.errors import CellwrightError
from tests.cli.conftest import CommandLine
from tests.support.warm import warm_start

AGENT = """
class Works:
    def run(self, client):
        client.start_competition()
        client.wait_for_order(timeout=1.0)
        client.send_arm([[1.76, 0.28, -1.38, 1.5, 3.27, -1.51, 0.0]], times=[1.0])
        client.sleep(1.5)
        client.end_competition()
"""


@dataclass
class Verified:
    """Output of a verification."""

    status: int
    document: dict[str, Any]
    err: str


@pytest.fixture
def verified(cellwright: CommandLine, tmp_path: Path) -> Any:
    """Run something with `--record`, remove all files that it was read from, and verify."""

    def run(*arguments: str, trial: str = "lesson") -> Verified:
        folder = tmp_path / "taken away"
        folder.mkdir()
        shutil.copy(find_trial(trial), folder / "mine.yaml")
        (folder / "agent.py").write_text(AGENT)
        file = str(tmp_path / "run.mcap")
        ran = cellwright(
            *("run", str(folder / "mine.yaml"), "--agent", f"{folder / 'agent.py'}:Works", "--no-picture"),
            *("--record", file),
            *arguments,
        )
        assert ran.status == 0, ran.err
        shutil.rmtree(folder)
        ran = cellwright("replay", file, "--verify", "--json")
        return Verified(ran.status, json.loads(ran.out), ran.err)

    return run


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [[], ["--vary", "--seed", "5", "--servo", "precise", "-d"], ["--checkpoint", "1.0:c.npz"]],
    ids=["plain", "varied", "checkpoint"],
)
def test_run_is_equal_from_recording_alone(verified: Any, arguments: list[str]) -> None:
    found = verified(*arguments)

    assert (found.status, found.err) == (0, "")
    assert found.document["answer"] == "equal"
    assert found.document["state_hashes"] >= 2
    assert found.document["frames"] > 30
    assert found.document["commands"] >= 3
    assert found.document["reached"] == found.document["equal_until"]
    assert found.document["versions"] == []


def test_run_from_checkpoint_is_equal(verified: Any, cellwright: CommandLine) -> None:
    cellwright("run", "lesson", "--agent", "none", "--until", "1.5", "--no-picture", "--checkpoint", "1.0:c.npz")
    ran = cellwright(
        *("run", "lesson", "--agent", "none", "--until", "2.5", "--no-picture", "--resume", "c.npz"),
        *("--record", "r.mcap"),
    )
    assert ran.status == 0
    Path("c.npz").unlink()

    ran = cellwright("replay", "r.mcap", "--verify", "--json")

    document = json.loads(ran.out)
    assert (ran.status, document["answer"]) == (0, "equal")
    assert document["begun"] == {"tick": 500, "time": 1.0}
    assert document["reached"]["time"] == 2.5


def test_verdict_is_printed_as_text(cellwright: CommandLine) -> None:
    cellwright("run", "lesson", "--agent", "none", "--until", "1", "--no-picture", "--record", "r.mcap")

    ran = cellwright("replay", "r.mcap", "--verify")

    assert (ran.status, ran.err) == (0, "")
    assert re.fullmatch(
        r"compared +1 state hash and \d+ frames equal, 0 commands\n"
        r"equal +up to tick 500 \(1\.000 s\)\n"
        r"ran +1\.0 s in \d+\.\d s: \d+\.\d x real time\n",
        ran.out,
    )


def test_recording_cut_before_first_hash_is_unknown(cellwright: CommandLine) -> None:
    cellwright("run", "lesson", "--agent", "none", "--until", "0.9", "--no-picture", "--record", "r.mcap")
    data = Path("r.mcap").read_bytes()
    Path("cut.mcap").write_bytes(data[: len(data) * 6 // 10])

    ran = cellwright("replay", "cut.mcap", "--verify")

    assert ran.status == 2
    assert "cut short" in ran.err
    assert re.search(r"^unknown +cut short before the first state hash", ran.out, re.MULTILINE)


def test_recording_with_changed_byte_is_refused(short: Path, cellwright: CommandLine) -> None:
    data = bytearray(short.read_bytes())
    with RecordingFile(short) as recording:  # of a message that no comparison reads
        place = next(each for each in recording._layout.chunks)
    data[place.offset + place.length - 1] ^= 1
    Path("flipped.mcap").write_bytes(data)

    ran = cellwright("replay", "flipped.mcap", "--verify")

    assert (ran.status, ran.out) == (2, "")
    assert re.fullmatch(r"error: flipped\.mcap: damaged at byte \d+: .*\n", ran.err)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of a tenth of a second of a cell."""
    path = tmp_path_factory.mktemp("short") / "run.mcap"
    arguments = ["run", "lesson", "--agent", "none", "--until", "0.1", "--no-picture", "--record", str(path)]
    assert main(arguments) == 0
    return path


class Changed:
    """A recording with a different header."""

    def __init__(self, recording: RecordingFile, kind: str, **facts: Any) -> None:
        facts = {**recording.header.facts, **facts}
        self.header = RecordingHeader(kind, recording.header.name, facts)
        self.sources = recording.sources
        self.start = None


@pytest.mark.parametrize(
    ("kind", "facts", "reason"),
    [
        ("cell", {"files": []}, "lacks the files"),
        ("cell", {"files": ["../x"]}, "invalid file name"),
        ("cell", {"files": ["files/none.yaml"]}, "lacks none.yaml; it was cut short too early"),
        ("cell", {"seed": "x"}, "seed is 'x'"),
        ("cell", {"servo": "soft"}, "servo profile 'soft'"),
        ("cell", {"checkpoints": [-1]}, "checkpoints are not times"),
        ("cell", {"checkpoints": None}, "checkpoints are not times"),
        ("cell", {"overrides": "time_limit=60"}, "overrides is 'time_limit=60'"),
        ("cell", {"overrides": [60]}, r"overrides is \[60\]"),
        ("cell", {"overrides": ["time_limit"]}, "overrides in the recording: must be KEY=VALUE"),
        ("cell", {"overrides": ["time_limt=60"]}, "overrides in the recording: time_limt: unknown top-level entry"),
        ("robot", {"driver": True}, "a driver moved this robot"),
        ("robot", {"driver": False, "files": ["files/none.yml"]}, "none.yml"),
        ("robot", {"driver": False, "xacro_arguments": {"side": 1}}, "xacro_arguments is {'side': 1}"),
    ],
)
def test_unrepeatable_run_is_reported_in_one_line(short: Path, kind: str, facts: dict[str, Any], reason: str) -> None:
    with RecordingFile(short) as recording:
        changed: Any = Changed(recording, kind, **facts)
        with pytest.raises(CellwrightError, match=reason), rebuild(changed):
            pass


def test_difference_is_reported_with_bodies_and_versions() -> None:
    from io import StringIO

    from rich.console import Console

    text = StringIO()
    verdict = VerificationResult(
        begun=TickTime(0, 0),
        reached=TickTime(10000, 2 * 10**10),
        hashes=3,
        frames=700,
        commands=9,
        equal_until=TickTime(5000, 10**10),
        different=TickTime(10000, 2 * 10**10),
        moved=TickTime(6020, 12_040_000_000),
        bodies=("piston_rod_part_1", "wrist_3_link"),
        wall=2.0,
    )
    others = versions_that_differ({"mujoco": "4.0.1", "numpy": "2.4.6"}, {"mujoco": "4.1.0", "numpy": "2.4.6"})

    show_verdict(Console(file=text, width=200), verdict, others)

    assert text.getvalue().splitlines() == [
        "compared    3 state hashes and 700 frames equal, 9 commands",
        "different   at tick 6020 (12.040 s); equal up to tick 5000 (10.000 s)",
        "bodies      piston_rod_part_1, wrist_3_link",
        "ran         20.0 s in 2.0 s: 10.0 x real time",
        "version     mujoco 4.0.1, here 4.1.0",
    ]


def test_robot_run_is_equal(cellwright: CommandLine) -> None:
    ran = cellwright(
        *("teleop", "tandem", "--sim-time", "--speed", "max", "--until", "1", "--port", "0"),
        *("--max-speed", "1.5", "--watchdog", "0.5", "--record", "r.mcap"),
    )
    assert ran.status == 0

    ran = cellwright("replay", "r.mcap", "--verify", "--json")

    document = json.loads(ran.out)
    assert (ran.status, document["answer"], document["state_hashes"]) == (0, "equal", 1)
    assert document["reached"] == {"tick": 240, "time": 1.0}


def test_other_points_are_reported() -> None:
    from io import StringIO

    from rich.console import Console

    text = StringIO()
    begun, reached = TickTime(0, 0), TickTime(500, 10**9)
    verdict = VerificationResult(
        begun, reached, hashes=2, points=2.0, recorded_points=8.0, equal_until=reached, wall=1.0
    )

    show_verdict(Console(file=text, width=200), verdict, [])

    assert text.getvalue().splitlines()[1:] == [
        "points      2 by the commands, but 8 in the recording",
        "ran         1.0 s in 1.0 s: 1.0 x real time",
    ]


PATCHED = """
from agent import Works
from cellwright.cell.kitting.scorer import GameScore


class Patched(Works):
    def run(self, client):
        GameScore.total = property(lambda score: 8.0)
        super().run(client)
"""


@pytest.mark.slow
def test_recording_of_a_program_that_patches_its_scorer_is_different(cellwright: CommandLine) -> None:
    Path("agent.py").write_text(AGENT)
    Path("patched.py").write_text(PATCHED)
    run = "from cellwright.cli.main import main; main()"
    work = ["run", "lesson", "--agent", "patched.py:Patched", "--no-picture", "--record", "run.mcap", "--json"]
    ran = warm_start().run(f"import sys; sys.argv[1:] = {work!r}; {run}", folder=Path.cwd())
    assert json.loads(ran.stdout)["score"]["total"] == 0.0  # from its orders
    verified = cellwright("replay", "run.mcap", "--verify", "--json")
    document = json.loads(verified.out)
    assert (verified.status, document["answer"]) == (1, "different")
    assert (document["points"], document["recorded_points"]) == (0.0, 8.0)
