"""Cost of viewing and recording a run: a page, a page in a browser, a recording, a video.

The bundled agent works the lesson, bare and with each of them in turn, at full speed. The processor time of the cell's
process is compared, without its start. Pages, browsers and videos are drawn in other processes, which need cores of
their own. Runs of the same trial end in the same state.

With a browser, the lesson runs in real time, and `trial.yaml` at full speed: a browser needs longer than the lesson to
open a page. A browser that draws without a graphics card slows everything on a small machine down. So the bare run has
one beside it, too, with the page of another cell: the ratio is what the page itself costs its cell.
"""

from __future__ import annotations

import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Event, Thread

from benchmarks.benchmarks import BenchmarkSkippedError, Figure, OnProgress
from benchmarks.processes import end

UNTIL, FILMED = 60.0, 8.0
"""Simulation time [s] of a run, and of one with a video, which takes long to draw."""
REPEATS = 5
VIEW_COST, SEEN_COST = 1.05, 1.1
"""Bounds of a page's cost, as a ratio to the bare run: without a browser, and in one."""
LONG = 500.0
"""Simulation time [s] of the run at full speed with a browser."""

_SHORT = 0.02  # [s], a run that is all start
_ADDRESS = re.compile(r"http://\S+")
_PAGE = ["--view", "--view-port", "0"]
_FAST, _REAL_TIME = ["lesson", "--speed", "max"], ["lesson", "--speed", "1"]
_LONG = [str(Path(__file__).with_name("trial.yaml")), "--speed", "max"]
_BROWSERS = ("chromium", "chromium-browser", "google-chrome")
_SMALL = ("--window-size=640,480", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
_PLAIN = "&fixedDpr=0.4"  # drawn without a graphics card, in fewer points: the page asks for the more moments
_LOOKS = 0.25  # [s] between checks of the connection
_CONNECTED = "01"  # as Linux has it in /proc/net/tcp
_TICKS = 1 / os.sysconf("SC_CLK_TCK") if hasattr(os, "sysconf") else math.nan  # [s]


@dataclass(frozen=True)
class FinishedRun:
    """Figures of a finished run.

    Attributes:
        processor: time of its own process [s].
        wall: duration of the run itself [s].
        state_hash: at the end.
        file_size: of its output file [bytes].
        seen: time that a browser had its page open [s].
    """

    processor: float
    wall: float
    state_hash: str
    file_size: int
    viewed: float = 0.0


def measure(on_progress: OnProgress, *, quick: bool = False) -> Iterator[Figure]:
    """Measure all of them.

    Raises:
        BenchmarkSkippedError: this system does not report the processor time of a process.
    """
    if not Path("/proc/self/stat").exists():
        raise BenchmarkSkippedError("requires /proc, where Linux reports the processor time of a process")
    until, filmed, repeats = (0.5, 0.2, 1) if quick else (UNTIL, FILMED, REPEATS)
    found: list[FinishedRun] = []
    on_progress("a page and a recording")
    with tempfile.TemporaryDirectory(prefix="cellwright-") as folder:
        options = {
            "": _FAST,
            "a page without a browser": [*_PAGE, *_FAST],
            "a recording": ["--record", f"{folder}/run.mcap", *_FAST],
        }
        best = _in_turn(options, until, repeats, found)
        for label, run in best.items():
            if label:
                bound = VIEW_COST if "page" in label else None
                size = f"; {run.file_size / 1e6:.1f} MB for {until:g} s" if run.file_size else ""
                yield _ratio(label, run, best[""], bound, f"{run.processor:.2f} and {best[''].processor:.2f} s{size}")
        yield from _browser(on_progress, until, min(repeats, 2), found)
        yield from _video(on_progress, folder, filmed, repeats)
    ends = {run.state_hash for run in found}
    yield Figure("different end states of the runs of the lesson", len(ends), "", maximum=1)


def _browser(on_progress: OnProgress, until: float, repeats: int, found: list[FinishedRun]) -> Iterator[Figure]:
    browser = next((path for name in _BROWSERS if (path := shutil.which(name))), None)
    label = "a page in a browser"
    if browser is None:
        yield Figure(f"{label} / bare", math.nan, note="Chromium is not installed")
        return
    long = until / UNTIL * LONG
    for pace, run_options, end_at in (("real time", _REAL_TIME, until), ("full speed", _LONG, long)):
        on_progress(f"{label}, {pace}")
        ended = found if end_at == until else []
        best = _in_turn({"": run_options, label: [*_PAGE, *run_options]}, end_at, repeats, ended, browser)
        run, bare = best[label], best[""]
        note = f"Chromium without a display for {run.viewed:.0f} s; {run.processor:.2f} and {bare.processor:.2f} s"
        if run.viewed:
            yield _ratio(f"{label}, {pace}", run, bare, SEEN_COST, note)
        else:
            yield Figure(f"{label}, {pace} / bare", math.nan, note="the browser did not connect")


def _video(on_progress: OnProgress, folder: str, until: float, repeats: int) -> Iterator[Figure]:
    on_progress("a video")
    file = f"{folder}/run.mp4"
    large = ["--video", file, "--video-size", "1280x720", *_FAST]
    options = {"": _FAST, "a video": large, "without a size": ["--video", file, *_FAST]}
    best = _in_turn(options, until, min(repeats, 2), [])
    bare, video, sized = best.values()
    count = math.floor(until * 25) + 1
    yield _ratio("a video", video, bare, None, f"1280 x 720, 25 pictures a second; {count} pictures in all")
    yield Figure("a picture of a video, in wall time", (video.wall - bare.wall) / count * 1e3, "ms", note="all cores")
    ratio = (sized.wall - bare.wall) / (video.wall - bare.wall) if video.wall > bare.wall else math.nan
    note = f"{sized.wall:.1f} s for {until:g} s, where the video plays for as long; the size is chosen by drawing"
    yield Figure("a video without a size / of 1280 x 720, in wall time", ratio, note=note)


def _ratio(label: str, run: FinishedRun, bare: FinishedRun, maximum: float | None, note: str) -> Figure:
    value = run.processor / bare.processor if bare.processor > 0 else math.nan
    return Figure(f"{label} / bare", value, maximum=maximum, note=note)


def _in_turn(
    options: dict[str, list[str]], until: float, repeats: int, found: list[FinishedRun], browser: str | None = None
) -> dict[str, FinishedRun]:
    """Return the fastest run with each of some options, its start subtracted."""
    best: dict[str, FinishedRun] = {}
    start: dict[str, float] = {}
    for _ in range(repeats):
        for name, more in options.items():
            start[name] = min(start.get(name, math.inf), _run(more, _SHORT, None).processor)
            run = _run(more, until, browser)
            found.append(run)
            if name not in best or run.processor < best[name].processor:
                best[name] = run
    return {name: replace(run, processor=run.processor - start[name]) for name, run in best.items()}


def _run(options: Sequence[str], until: float, browser: str | None) -> FinishedRun:
    """Run a trial. With a browser, open its page as soon as it is there; if it has none, that of another cell."""
    with _other_page(browser) if browser and "--view" not in options else nullcontext():
        process = _started([*options, "--until", str(until)])
        assert process.stdout is not None
        assert process.stderr is not None
        page = None
        for line in process.stderr:
            address = _ADDRESS.search(line)
            if address and browser and page is None:
                page = _Visit(browser, address[0])
        document = json.loads(process.stdout.read())
        processor = _own_time(process.pid)  # it has ended; its figures remain until its exit status is read
        process.wait()
    process.stdout.close()
    process.stderr.close()
    viewed = page.end() if page is not None else 0.0
    files = [Path(word) for word in options if word.endswith((".mcap", ".mp4"))]
    size = sum(file.stat().st_size for file in files if file.exists())
    return FinishedRun(processor, document["wall"], document["state_hash"], size, viewed)


def _started(options: Sequence[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(  # noqa: S603
        [sys.executable, "-m", "cellwright", "run", "--json", "--no-picture", *options],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "CELLWRIGHT_PAGE_PLAIN": "1"},
    )


@contextmanager
def _other_page(browser: str) -> Iterator[None]:
    """Show the page of another cell at work in a browser."""
    process = _started([_LONG[0], *_PAGE, "--speed", "1"])
    assert process.stderr is not None
    address = next(found[0] for line in process.stderr if (found := _ADDRESS.search(line)))
    page = _Visit(browser, address)
    try:
        yield
    finally:
        page.end()
        end(process)
        process.communicate()


class _Visit:
    """A browser with a page open, and the time that it has been connected."""

    def __init__(self, browser: str, address: str) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="cellwright-", ignore_cleanup_errors=True)
        options = ["--headless", "--no-sandbox", "--no-first-run", f"--user-data-dir={self._folder.name}", *_SMALL]
        more = _PLAIN if "?" in address else f"?{_PLAIN[1:]}"
        self._process = subprocess.Popen(  # noqa: S603
            [browser, *options, "--remote-debugging-port=0", address + more],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            text=True,
        )
        self._port = int(re.findall(r":(\d+)", address)[0])
        self._seen, self._is_over = 0.0, Event()
        self._watch = Thread(target=self._look, daemon=True)
        self._watch.start()

    def end(self) -> float:
        """Close the browser; return the time that it was connected [s]."""
        self._is_over.set()
        self._watch.join()
        end(self._process)
        self._folder.cleanup()
        return self._seen

    def _look(self) -> None:
        while not self._is_over.wait(_LOOKS):
            rows = [line.split() for line in Path("/proc/net/tcp").read_text().splitlines()[1:]]
            if any(int(row[1].partition(":")[2], 16) == self._port and row[3] == _CONNECTED for row in rows):
                self._seen += _LOOKS


def _own_time(pid: int) -> float:
    """Return the processor time of a process that has ended [s], without its children."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICKS
