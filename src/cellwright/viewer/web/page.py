"""Page: one viser server, its features, and the loop that shows interpolated frames on it."""

from __future__ import annotations

import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from cellwright.middleware.server.streams import PERIOD
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.connection import AwayError, Connection
from cellwright.viewer.web.input import Input
from cellwright.viewer.web.poller import NewFrame, NewPanel, NewScene, PollResult, StatePoller

_DELAY = 1.5  # delay of the page in usual frame periods: one frame may come late unnoticed
_MAX_GAP = 0.25  # [s]: frames at longer intervals are shown as they come
_LEAP = 0.5  # [m]: a body that moves farther between two frames jumps; it is not interpolated
_PERIOD = 1 / 60  # [s] between two moments
_IDLE = 0.5  # [s] between two checks for browsers
_LAST_WORD = 0.5  # [s] for the server to give the reason of its end
_ON_ITS_WAY = 0.5  # [s] for the last messages to reach browsers


@dataclass(frozen=True, slots=True)
class TimelineFrame:
    """Frame to show.

    Attributes:
        frame: poses of the bodies.
        is_cut: True if it does not continue the previous one: after a reset or a jump in time, and at first.
        moved: (bodies,) True for those that moved since the previous moment; all after a cut.
        switched: (bodies,) True for those that appeared or disappeared; all after a cut.
    """

    frame: SceneFrame
    is_cut: bool
    moved: NDArray[np.bool_]
    switched: NDArray[np.bool_]

    @classmethod
    def of(cls, frame: SceneFrame, before: SceneFrame | None = None) -> TimelineFrame:
        """Moment of a frame after the one `before` it; a cut if there is none."""
        if before is None:
            everything = np.ones(len(frame.poses), np.bool_)
            return cls(frame, True, everything, everything)
        return cls(frame, False, (frame.poses != before.poses).any(axis=1), frame.shown != before.shown)


@dataclass(frozen=True, slots=True)
class _Arrival:
    frame: SceneFrame
    wall: float
    run: int


class FrameInterpolator:
    """Interpolator of incoming frames, by wall time."""

    def __init__(self) -> None:
        self._arrivals: deque[_Arrival] = deque(maxlen=8)
        self._period = PERIOD
        self._is_cut = True
        self._shown: SceneFrame | None = None

    def take(self, frame: SceneFrame, *, run: int, wall: float) -> None:
        """Add a frame of a run that came at `wall` [s]."""
        if self._arrivals:
            newest = self._arrivals[-1]
            is_other = len(frame.poses) != len(newest.frame.poses)
            if run != newest.run or frame.time < newest.frame.time or is_other:
                self.cut()
            elif (gap := wall - newest.wall) < _MAX_GAP:
                self._period += 0.1 * (gap - self._period)
        self._arrivals.append(_Arrival(frame, wall, run))

    def cut(self) -> None:
        """Discard the frames: the next one does not continue them."""
        self._arrivals.clear()
        self._is_cut = True

    def at(self, wall: float) -> TimelineFrame | None:
        """Moment to show at `wall` [s]; None if it is the one returned last."""
        if not self._arrivals:
            return None
        is_cut, self._is_cut = self._is_cut, False
        frame = self._frame(wall - _DELAY * self._period)
        if frame is self._shown and not is_cut:
            return None
        before, self._shown = self._shown, frame
        return TimelineFrame.of(frame, None if is_cut else before)

    def _frame(self, wall: float) -> SceneFrame:
        arrivals = self._arrivals
        while len(arrivals) > 1 and arrivals[1].wall <= wall:
            arrivals.popleft()
        if len(arrivals) == 1 or wall <= arrivals[0].wall:
            return arrivals[0].frame
        before, after = arrivals[0], arrivals[1]
        gap = after.wall - before.wall
        if gap > _MAX_GAP:
            return before.frame
        return interpolate_frames(before.frame, after.frame, (wall - before.wall) / gap)


def interpolate_frames(before: SceneFrame, after: SceneFrame, share: float) -> SceneFrame:
    """Interpolate between two frames, `share` (0..1) of the way: positions linearly, rotations on their arc."""
    if np.array_equal(before.poses, after.poses) and np.array_equal(before.shown, after.shown):
        return before
    poses = before.poses + np.float32(share) * (after.poses - before.poses)
    poses[:, 3:] = _turned(before.poses[:, 3:], after.poses[:, 3:], share)
    leap = np.abs(after.poses[:, :3] - before.poses[:, :3]).max(axis=1) > _LEAP
    leap |= before.shown != after.shown
    poses[leap] = before.poses[leap]
    time = round(before.time + share * (after.time - before.time))
    return SceneFrame(time, poses, before.shown)


def _turned(before: NDArray[np.float32], after: NDArray[np.float32], share: float) -> NDArray[np.float32]:
    """Interpolate quaternions (n, 4). The turns are small, so normalised linear interpolation is close enough."""
    sign = np.where((before * after).sum(axis=1, keepdims=True) < 0, -1.0, 1.0).astype(np.float32)
    mixed = before + np.float32(share) * (sign * after - before)
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    turned: NDArray[np.float32] = np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), after).astype(np.float32)
    return turned


class Feature:
    """Part of the page: something it shows or controls. The page's own thread calls all of its methods.

    Callbacks of viser run in viser's threads: they may use `page.link` and set handles.
    """

    page: Page
    """The page; set before any method is called."""

    def on_scene(self, scene: Scene) -> None:
        """Start showing a scene: the first one, or a replacement.

        Handles of the previous scene below `page.root` are removed already; those of the GUI are not.
        """

    def wants(self) -> dict[str, Any]:
        """Overlays to request from the frame service, such as `{"contacts": True}`."""
        return {}

    def show(self, moment: TimelineFrame) -> None:
        """Show a moment: some 60 times a second while a browser is connected."""

    def on_frame(self, answer: dict[str, Any]) -> None:
        """Handle an answer of the frame service, with the overlays of all features: up to 20 times a second."""

    def panel(self, panel: dict[str, Any]) -> None:
        """Handle an answer of the panel service: a few times a second while a browser is connected."""

    def on_disconnect(self, reason: str) -> None:
        """Handle the loss of the server; the page keeps showing the last state."""

    def on_input(self, given: Input) -> None:
        """Handle the keys and the gamepad of a browser, in the thread that reads its messages: it must not wait."""


log = logging.getLogger(__name__)


class Page:
    """Page for the cell, robot, recording or evaluation behind a connection.

    Args:
        server: viser's server: features draw with `server.gui` and `server.scene`.
        link: connection to what it shows.
        features: its parts, in the order of their tabs.

    Attributes:
        link: connection for features; frames come over another one.
        scene: the scene it shows; None before the first answer.
        about: constants of the scene: `kind`, `sensors`, `tools`; empty if there are none.
        first_panel: answer of the panel service when the scene began; empty without one.
    """

    root = "/scene"
    """Root node of the whole scene; it is removed when another scene replaces it."""

    def __init__(self, server: viser.ViserServer, link: Connection, features: Sequence[Feature]) -> None:
        self.server = server
        self.link = link
        self.scene: Scene | None = None
        self.about: dict[str, Any] = {}
        self.first_panel: dict[str, Any] = {}
        self.features = tuple(features)
        for feature in self.features:
            feature.page = self
        self._interpolator = FrameInterpolator()
        self._poller = StatePoller(link.sibling(), self._wants)
        self._tabs: Any = None
        self._tab: dict[str, Any] = {}
        self._away_reason: str | None = None
        self._notice: Any = None
        self._is_over = False
        self._is_visible = True
        self._browsers = threading.Lock()
        server.on_client_connect(lambda _client: self._look_for_browsers())
        server.on_client_disconnect(lambda _client: self._look_for_browsers())

    def tab(self, name: str) -> Any:
        """Return the tab of this name, made on first use; `with page.tab("View"): …` fills it."""
        if self._tabs is None:
            self._tabs = self.server.gui.add_tab_group()
        if name not in self._tab:
            self._tab[name] = self._tabs.add_tab(name)
        return self._tab[name]

    def notify(self, title: str, text: str, *, is_bad: bool = False) -> None:
        """Show a notification in every browser for a few seconds."""
        for client in self.server.get_clients().values():
            client.add_notification(
                title=title, body=text, auto_close_seconds=8.0 if is_bad else 4.0, color="red" if is_bad else None
            )

    def run(self) -> None:
        """Show the server's state until `close`."""
        self._poller.start()
        try:
            while not self._is_over:
                started_at = time.perf_counter()
                while self._take_next(0.0):
                    pass
                if not self._poller.is_watched:
                    self._take_next(_IDLE)
                    continue
                moment = self._interpolator.at(time.perf_counter())
                if moment is not None:
                    self._show(moment)
                spent = time.perf_counter() - started_at
                time.sleep(max(_PERIOD - spent, spent / 2))  # leave part of a core free
        finally:
            if self.server.get_clients():
                self._announce_end()
            self._poller.close()
            self.link.close()

    def set_visible(self, is_visible: bool) -> None:  # noqa: FBT001 -- the only argument of a callback
        """Follow the server only while a browser's tab is visible; any thread may call it."""
        self._is_visible = is_visible
        self._look_for_browsers()

    def take_input(self, given: Input) -> None:
        """Pass on the keys and the gamepad of a browser; any thread may call it."""
        self._each(lambda feature: feature.on_input(given))

    def close(self) -> None:
        """End `run`; any thread may call it."""
        self._is_over = True

    def _wants(self) -> dict[str, Any]:
        overlays: dict[str, Any] = {}
        if self._poller.is_watched:
            self._each(lambda feature: overlays.update(feature.wants()))
        return overlays

    def _take_next(self, timeout: float) -> bool:
        """Handle the next result of the poller, waiting at most `timeout` [s]; return whether there was one."""
        try:
            self._take(self._poller.results.get(timeout > 0.0, timeout))
        except Empty:
            return False
        return True

    def _take(self, result: PollResult) -> None:
        match result:
            case NewScene(scene, about):
                self._begin(scene, about)
            case AwayError():
                self._lose(str(result))
            case NewPanel(panel):
                self._each(lambda feature: feature.panel(panel))
            case NewFrame(wall, frame, answer):
                self._find_again()
                self._interpolator.take(frame, run=int(answer.get("run", 0)), wall=wall)
                with self.server.atomic():
                    self._each(lambda feature: feature.on_frame(answer))
                if not self._poller.is_watched:  # the next browser sees this at once
                    moment = self._interpolator.at(time.perf_counter() + 1.0)
                    if moment is not None:
                        self._show(moment)

    def _begin(self, scene: Scene, about: dict[str, Any]) -> None:
        self._find_again()
        self.scene, self.about = scene, about
        self._interpolator.cut()
        try:
            self.first_panel = self.link.ask(PANEL)
        except CellwrightError:  # there is none, or not yet
            self.first_panel = {}
        with self.server.atomic():
            self.server.scene.remove_by_name(self.root)
            self.server.scene.add_frame(self.root, show_axes=False)
            self._each(lambda feature: feature.on_scene(scene))

    def _show(self, moment: TimelineFrame) -> None:
        with self.server.atomic():
            self._each(lambda feature: feature.show(moment))

    def _lose(self, reason: str) -> None:
        if self._away_reason is None:
            self._interpolator.cut()
            self.notify("Disconnected", f"{reason}. The page reconnects when the server is back.", is_bad=True)
            self._notice = self.server.gui.add_markdown(
                f"**Not connected:** {reason}. The page reconnects when the server is back.", order=-1.0
            )
            self._each(lambda feature: feature.on_disconnect(reason))
        self._away_reason = reason

    def _announce_end(self) -> None:
        """Leave browsers with the last state, the reason of the end, and no controls."""
        reason = self._last_word() if self._away_reason is None else self._away_reason
        if self._away_reason is not None:
            self._notice.remove()
        self.server.gui.add_markdown(f"**This page has ended:** {reason}. It shows the last state.", order=-1.0)
        self._each(lambda feature: feature.on_disconnect(reason))
        self.server.flush()
        time.sleep(_ON_ITS_WAY)

    def _last_word(self) -> str:
        """Reason why the server has ended, if it gives one now."""
        end = time.perf_counter() + _LAST_WORD
        self._poller.wake()
        while (left := end - time.perf_counter()) > 0:
            try:
                result = self._poller.results.get(timeout=left)
            except Empty:
                break
            if isinstance(result, AwayError):
                return str(result)
            self._take(result)
        return "the viewer was closed"

    def _find_again(self) -> None:
        if self._away_reason is not None:
            self._away_reason = None
            self._notice.remove()
            self.notify("Connected", "The server is back.")

    def _each(self, do: Callable[[Feature], None]) -> None:
        """Call a function for each feature. One that raises is dropped; the others go on."""
        for feature in self.features:
            try:
                do(feature)
            except Exception:
                log.exception("%s failed and was removed from the page", type(feature).__name__)
                self.features = tuple(each for each in self.features if each is not feature)

    def _look_for_browsers(self) -> None:
        with self._browsers:
            self._poller.is_watched = self._is_visible and bool(self.server.get_clients())
        if self._poller.is_watched:
            self._poller.wake()
