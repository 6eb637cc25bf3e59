"""Videos of a data set: AV1 in MP4 files, with frame k of a file at exactly k / rate seconds."""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from av.codec.codec import UnknownCodecError
from av.video.stream import VideoStream
from numpy.typing import NDArray

from cellwright.recording.dataset.layout import MAX_VIDEO_MB, VIDEO_PATH, place
from cellwright.util.errors import CellwrightError

PIXELS = "yuv420p"
_ENCODER = "libsvtav1"
_KEY_EVERY, _QUALITY, _PRESET = 2, 30, 12
_OPTIONS = {
    "g": str(_KEY_EVERY),
    "crf": str(_QUALITY),
    "preset": str(_PRESET),
    "svtav1-params": "lp=1",  # one thread: other processes use the remaining processors
}
_ERRORS_ALONE = "1"
_FASTSTART = {"movflags": "faststart"}
_THREADS = Path("/proc/self/task")  # on Linux


class Clip:
    """Video of one camera in one episode, encoded in memory on its own: its bytes depend on its pictures alone.

    Args:
        width: even number of pixels.
        height: even number of pixels.
        rate: pictures per second.

    Attributes:
        width: width of the pictures [pixels].
        height: height of the pictures [pixels].
        frames: number of pictures so far.

    Raises:
        CellwrightError: the installed package av has no encoder for AV1, or it does not take this size.
    """

    def __init__(self, width: int, height: int, rate: int) -> None:
        self.width, self.height, self.frames = width, height, 0
        os.environ.setdefault("SVT_LOG", _ERRORS_ALONE)  # the encoder reads it when it starts, and prints on stderr
        self._content = io.BytesIO()
        self._container = av.open(self._content, "w", format="mp4")
        try:
            stream = self._container.add_stream(_ENCODER, rate=rate, options=_OPTIONS)
        except UnknownCodecError:
            raise CellwrightError(f"av: has no encoder {_ENCODER}; run: pip install 'cellwright[video]'") from None
        assert isinstance(stream, VideoStream)
        stream.width, stream.height, stream.pix_fmt = width, height, PIXELS
        self._stream, self._tick = stream, Fraction(1, rate)

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture (height, width, 3), sRGB."""
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format="rgb24")
        frame.pts, frame.time_base = self.frames, self._tick
        self._encode(frame)
        self.frames += 1

    def finish(self) -> bytes:
        """Encode the remaining pictures, and return the video as the bytes of an MP4 file."""
        self._encode(None)
        self._container.close()
        return self._content.getvalue()

    def _encode(self, frame: av.VideoFrame | None) -> None:
        starts = _kept_scheduling() if self.frames == 0 else nullcontext()
        try:
            with starts:
                self._container.mux(self._stream.encode(frame))
        except av.FFmpegError as error:
            size = f"{self.width} x {self.height}"
            raise CellwrightError(f"{_ENCODER}: cannot encode pictures of {size}: {error}") from None


class CameraVideos:
    """Videos of one camera: clips one after the other, in files that are cut between clips.

    Args:
        folder: of the data set.
        key: feature of the camera's pictures.
        rate: pictures per second.
        max_bytes: size of a file; only a longer clip, in a file of its own, exceeds it.
    """

    def __init__(self, folder: Path, key: str, rate: int, max_bytes: int = MAX_VIDEO_MB * 1_000_000) -> None:
        self._folder, self._key, self._rate, self._max_bytes = folder, key, rate, max_bytes
        self._container: Any = None
        self._stream: Any = None
        self._number = self._bytes = self._frames = 0

    def append(self, clip: bytes) -> dict[str, Any]:
        """Append a clip; return its place in columns of the table of episodes, with times [s] in its own file."""
        if self._container is not None and self._bytes + len(clip) > self._max_bytes:
            self.close()
            self._number += 1
        with av.open(io.BytesIO(clip), "r") as source:
            stream = source.streams.video[0]
            if self._container is None:
                self._open(stream)
            begin = self._frames
            for packet in source.demux(stream):
                if packet.dts is not None:  # the last one is empty: it flushes decoders
                    self._copy(packet)
        self._bytes += len(clip)
        times = {"from_timestamp": begin / self._rate, "to_timestamp": self._frames / self._rate}
        return {f"videos/{self._key}/{name}": value for name, value in {**place(self._number), **times}.items()}

    def close(self) -> None:
        """Finish the present file, with its index at its beginning."""
        if self._container is not None:
            self._container.close()
            self._container = None

    def _open(self, template: VideoStream) -> None:
        path = self._folder / VIDEO_PATH.format(video_key=self._key, **place(self._number))
        path.parent.mkdir(parents=True, exist_ok=True)
        self._container = av.open(str(path), "w", format="mp4", options=_FASTSTART)
        self._stream = self._container.add_stream_from_template(template, opaque=True)  # packets are copied as they are
        self._bytes = self._frames = 0

    def _copy(self, packet: Any) -> None:
        """Copy a packet, which is one picture: AV1 has no packets out of order."""
        packet.stream, packet.time_base = self._stream, Fraction(1, self._rate)
        packet.pts = packet.dts = self._frames
        packet.duration = 1
        self._container.mux(packet)
        self._frames += 1


@contextmanager
def _kept_scheduling() -> Iterator[None]:
    """Keep the scheduling of this thread, and give it to all threads that are started meanwhile.

    Where it may, as for root, SVT-AV1 makes its own threads and that of its caller real-time ones, of the highest
    priority. All that the caller starts later inherits that, and other programs get no processor.
    """
    if not _THREADS.exists():
        yield
        return
    policy, parameters, before = os.sched_getscheduler(0), os.sched_getparam(0), {*os.listdir(_THREADS)}
    try:
        yield
    finally:
        os.sched_setscheduler(0, policy, parameters)
        for thread in {*os.listdir(_THREADS)} - before:
            with suppress(ProcessLookupError):  # it has ended
                os.sched_setscheduler(int(thread), policy, parameters)


def video_feature(width: int, height: int, rate: int) -> dict[str, Any]:
    """Return the entry of info.json for pictures of this size [pixels] and rate [Hz]."""
    about = {"height": height, "width": width, "codec": "av1", "pix_fmt": PIXELS, "fps": rate, "channels": 3}
    about |= {"g": _KEY_EVERY, "crf": _QUALITY, "preset": _PRESET, "fast_decode": 0, "video_backend": "pyav"}
    info = {f"video.{name}": value for name, value in about.items()}
    info |= {"video.extra_options": {}, "has_audio": False, "is_depth_map": False}
    return {"dtype": "video", "shape": [height, width, 3], "names": ["height", "width", "channels"], "info": info}
