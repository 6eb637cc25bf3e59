"""Page: one viser server, its features, and the loop that shows interpolated frames on it."""

from __future__ import annotations

import logging
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from queue import Empty
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from cellwright.rendering.scene import Frame, Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import PANEL
from cellwright.viewer.web.connection import Asking, AwayError, Link

_DELAY = 1.5  # times the usual distance between two frames, by which the page is behind: one may come late unseen
_SLOWEST = 0.25  # [s]: frames that come less often than that are shown as they come
_LEAP = 0.5  # [m]: a body that moves farther between two frames was put there: it does not glide


@dataclass(frozen=True, slots=True)
class Moment:
    """What is shown.

    Attributes:
        frame: where the bodies are.
        is_cut: whether it does not follow from what was shown before: after a reset or a jump in time, and at first.
        moved: (bodies,) which of them are elsewhere than in the moment before; all of them after a cut.
        switched: (bodies,) which of them have come into sight or gone out of it; all of them after a cut.
    """

    frame: Frame
    is_cut: bool
    moved: NDArray[np.bool_]
    switched: NDArray[np.bool_]

    @classmethod
    def of(cls, frame: Frame, before: Frame | None = None) -> Moment:
        """The moment of a frame after the one `before` it; a cut where there is none."""
        if before is None:
            everything = np.ones(len(frame.poses), np.bool_)
            return cls(frame, True, everything, everything)
        return cls(frame, False, (frame.poses != before.poses).any(axis=1), frame.shown != before.shown)


@dataclass(frozen=True, slots=True)
class _Come:
    frame: Frame
    wall: float
    run: int


class Moments:
    """Frames as they come, and what is to be shown at a time of the wall clock."""

    def __init__(self) -> None:
        self._come: deque[_Come] = deque(maxlen=8)
        self._period = 1 / 30
        self._is_cut = True
        self._shown: Frame | None = None

    def take(self, frame: Frame, *, run: int, wall: float) -> None:
        """Take a frame of a run that came at `wall` [s]."""
        if self._come:
            newest = self._come[-1]
            is_other = len(frame.poses) != len(newest.frame.poses)
            if run != newest.run or frame.time < newest.frame.time or is_other:
                self.cut()
            elif (gap := wall - newest.wall) < _SLOWEST:
                self._period += 0.1 * (gap - self._period)
        self._come.append(_Come(frame, wall, run))

    def cut(self) -> None:
        """What comes next does not follow from what was before."""
        self._come.clear()
        self._is_cut = True

    def at(self, wall: float) -> Moment | None:
        """What is to be shown at `wall` [s]; None when that is what was asked for last."""
        if not self._come:
            return None
        is_cut, self._is_cut = self._is_cut, False
        frame = self._frame(wall - _DELAY * self._period)
        if frame is self._shown and not is_cut:
            return None
        before, self._shown = self._shown, frame
        return Moment.of(frame, None if is_cut else before)

    def _frame(self, wall: float) -> Frame:
        come = self._come
        while len(come) > 1 and come[1].wall <= wall:
            come.popleft()
        if len(come) == 1 or wall <= come[0].wall:
            return come[0].frame
        before, after = come[0], come[1]
        gap = after.wall - before.wall
        if gap > _SLOWEST:
            return before.frame
        return interpolate_frames(before.frame, after.frame, (wall - before.wall) / gap)


def interpolate_frames(before: Frame, after: Frame, share: float) -> Frame:
    """What lies between two frames of a scene, `share` (0..1) of the way: on a line, and on the way of a turn."""
    if np.array_equal(before.poses, after.poses) and np.array_equal(before.shown, after.shown):
        return before
    poses = before.poses + np.float32(share) * (after.poses - before.poses)
    poses[:, 3:] = _turned(before.poses[:, 3:], after.poses[:, 3:], share)
    leap = np.abs(after.poses[:, :3] - before.poses[:, :3]).max(axis=1) > _LEAP
    leap |= before.shown != after.shown
    poses[leap] = before.poses[leap]
    time = round(before.time + share * (after.time - before.time))
    return Frame(time, poses, before.shown)


def _turned(before: NDArray[np.float32], after: NDArray[np.float32], share: float) -> NDArray[np.float32]:
    """Quaternions (n, 4) between others. The turns are small, so a line, made a unit one again, is close enough."""
    sign = np.where((before * after).sum(axis=1, keepdims=True) < 0, -1.0, 1.0).astype(np.float32)
    mixed = before + np.float32(share) * (sign * after - before)
    length = np.linalg.norm(mixed, axis=1, keepdims=True)
    turned: NDArray[np.float32] = np.where(length > 1e-6, mixed / np.maximum(length, 1e-6), after).astype(np.float32)
    return turned


class Feature:
    """One thing that a page shows, or lets one do. All of its methods are called in the page's own thread.

    What viser calls when somebody clicks runs in threads of viser's: it may ask `page.link`, and may set handles.
    """

    page: Page
    """Where it is shown; set before anything is called."""

    def begin(self, scene: Scene) -> None:
        """A scene is shown from now on: the first one, or another in its place.

        Handles of the scene before are gone already when they are below `page.root`; those of the GUI are not.
        """

    def wants(self) -> dict[str, Any]:
        """What the frame service is to be asked for besides frames, such as `{"contacts": True}`."""
        return {}

    def show(self, moment: Moment) -> None:
        """Show what is at this moment: some 60 times a second while somebody looks on."""

    def told(self, answer: dict[str, Any]) -> None:
        """What the frame service answered, with all that features wanted: up to 30 times a second."""

    def panel(self, panel: dict[str, Any]) -> None:
        """What the panel service answered: a few times a second, while somebody looks on."""

    def away(self, reason: str) -> None:
        """Nobody answers any more; what is shown is the last that was known."""


log = logging.getLogger(__name__)

_PERIOD = 1 / 60  # [s] between two pictures
_IDLE = 0.5  # [s] between two looks at whether somebody looks on
_LAST_WORD = 0.5  # [s] for what is served to say why it has ended
_ON_ITS_WAY = 0.5  # [s] for what was said last to get to browsers


class Page:
    """A page on what is served at an address.

    Args:
        server: viser's: `server.gui` and `server.scene` are what features draw with.
        address: where the cell, the robot or the recording is served.
        features: what it is made of, in the order of their tabs.
        key: the key of the server there, for its own page.

    Attributes:
        link: the way to what is served, for features; it is not the one that frames come by.
        scene: what is shown; None before the first answer.
        about: what else was said of it: `kind`, `sensors`, `tools`; empty where nothing was.
        first_panel: what the panel service answered when the scene was begun; empty where it did not.
    """

    root = "/scene"
    """All that is seen hangs below this node, and goes with it when another scene takes its place."""

    def __init__(
        self, server: viser.ViserServer, address: tuple[str, int], features: Sequence[Feature], *, key: str = ""
    ) -> None:
        self.server = server
        self.link = Link(address, key=key)
        self.scene: Scene | None = None
        self.about: dict[str, Any] = {}
        self.first_panel: dict[str, Any] = {}
        self.features = tuple(features)
        for feature in self.features:
            feature.page = self
        self._moments = Moments()
        self._asking = Asking(Link(address, node=f"{self.link.node}_eyes", key=key), self._wants)
        self._tabs: Any = None
        self._tab: dict[str, Any] = {}
        self._away_reason: str | None = None
        self._notice: Any = None
        self._is_over = False
        server.on_client_connect(self._somebody_came)
        server.on_client_disconnect(self._somebody_left)

    def tab(self, name: str) -> Any:
        """The tab of this name on the panel, made when it is first asked for; `with page.tab("View"): …` fills it."""
        if self._tabs is None:
            self._tabs = self.server.gui.add_tab_group()
        if name not in self._tab:
            self._tab[name] = self._tabs.add_tab(name)
        return self._tab[name]

    def tell(self, title: str, text: str, *, is_bad: bool = False) -> None:
        """Show a line to everybody who looks on, for a few seconds."""
        for client in self.server.get_clients().values():
            client.add_notification(
                title=title, body=text, auto_close_seconds=8.0 if is_bad else 4.0, color="red" if is_bad else None
            )

    def run(self) -> None:
        """Keep up with what is served, until `close`."""
        self._asking.start()
        try:
            while not self._is_over:
                begun = time.perf_counter()
                while self._take_next(0.0):
                    pass
                if not self._asking.is_watched:
                    self._take_next(_IDLE)
                    continue
                moment = self._moments.at(time.perf_counter())
                if moment is not None:
                    self._show(moment)
                spent = time.perf_counter() - begun
                time.sleep(max(_PERIOD - spent, spent / 2))  # never all of a core
        finally:
            if self.server.get_clients():
                self._say_that_it_ends()
            self._asking.close()
            self.link.close()

    def close(self) -> None:
        """Let `run` end; from anywhere."""
        self._is_over = True

    def _wants(self) -> dict[str, Any]:
        wanted: dict[str, Any] = {}
        if self._asking.is_watched:
            self._each(lambda feature: wanted.update(feature.wants()))
        return wanted

    def _take_next(self, timeout: float) -> bool:
        """Take what has come, and wait for it so long at most [s]; whether something has."""
        try:
            self._take(self._asking.found.get(timeout > 0.0, timeout))
        except Empty:
            return False
        return True

    def _take(self, found: Any) -> None:
        match found:
            case (Scene(), about):
                self._begin(found[0], about)
            case AwayError():
                self._lose(str(found))
            case dict():
                self._each(lambda feature: feature.panel(found))
            case (wall, frame, answer):
                self._find_again()
                self._moments.take(frame, run=int(answer.get("run", 0)), wall=wall)
                with self.server.atomic():
                    self._each(lambda feature: feature.told(answer))
                if not self._asking.is_watched:  # who comes next sees this at once
                    moment = self._moments.at(time.perf_counter() + 1.0)
                    if moment is not None:
                        self._show(moment)

    def _begin(self, scene: Scene, about: dict[str, Any]) -> None:
        self._find_again()
        self.scene, self.about = scene, about
        self._moments.cut()
        try:
            self.first_panel = self.link.ask(PANEL)
        except CellwrightError:  # there is none, or it comes later
            self.first_panel = {}
        with self.server.atomic():
            self.server.scene.remove_by_name(self.root)
            self.server.scene.add_frame(self.root, show_axes=False)
            self._each(lambda feature: feature.begin(scene))

    def _show(self, moment: Moment) -> None:
        with self.server.atomic():
            self._each(lambda feature: feature.show(moment))

    def _lose(self, reason: str) -> None:
        if self._away_reason is None:
            self._moments.cut()
            self.tell("Gone", f"{reason}. This page looks for it and goes on when it is back.", is_bad=True)
            self._notice = self.server.gui.add_markdown(
                f"**Not connected:** {reason}. This page goes on when it is back.", order=-1.0
            )
            self._each(lambda feature: feature.away(reason))
        self._away_reason = reason

    def _say_that_it_ends(self) -> None:
        """Leave browsers with how all stood last, why it has ended, and nothing to press."""
        reason = self._last_word() if self._away_reason is None else self._away_reason
        if self._away_reason is not None:
            self._notice.remove()
        self.server.gui.add_markdown(f"**This page has ended:** {reason}. It shows how all stood last.", order=-1.0)
        self._each(lambda feature: feature.away(reason))
        self.server.flush()
        time.sleep(_ON_ITS_WAY)

    def _last_word(self) -> str:
        """Why what is served has ended, if it says so now."""
        end = time.perf_counter() + _LAST_WORD
        self._asking.wake()
        while (left := end - time.perf_counter()) > 0:
            try:
                found = self._asking.found.get(timeout=left)
            except Empty:
                break
            if isinstance(found, AwayError):
                return str(found)
            self._take(found)
        return "it was closed"

    def _find_again(self) -> None:
        if self._away_reason is not None:
            self._away_reason = None
            self._notice.remove()
            self.tell("Back", "What was gone is there again.")

    def _each(self, do: Callable[[Feature], None]) -> None:
        """Have each feature do something. One with a defect is left out from then on, and takes no other along."""
        for feature in self.features:
            try:
                do(feature)
            except Exception:
                log.exception("%s is left out of the page", type(feature).__name__)
                self.features = tuple(each for each in self.features if each is not feature)

    def _somebody_came(self, _client: viser.ClientHandle) -> None:
        self._asking.is_watched = True
        self._asking.wake()

    def _somebody_left(self, _client: viser.ClientHandle) -> None:
        self._asking.is_watched = bool(self.server.get_clients())
