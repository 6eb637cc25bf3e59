"""Video file: pictures in, H.264 in an MP4 file out, playable however the process ends."""

import contextlib
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn

import av
import numpy as np
from av.video.reformatter import ColorRange, Colorspace
from av.video.stream import VideoStream
from numpy.typing import NDArray

from cellwright.util.errors import CellwrightError

_CODECS = ("libx264", "mpeg4")  # the second if the first was left out for its licence
_QUALITY = {"crf": "21", "preset": "veryfast", "bf": "2", "rc-lookahead": "12"}
_THREADS = 2  # the same everywhere: the file must not depend on the number of processors
_BT709 = 1  # ISO/IEC 23091-4: the colours of HDTV, stored so that players need not guess
_WHOLE = {"movflags": "faststart"}
_PIECES = {"movflags": "frag_keyframe+empty_moov+default_base_moof", "flush_packets": "1"}


class FilmError(CellwrightError):
    """Error of a video that cannot be written; the text says why."""


class Film:
    """Video file under way.

    It is written in pieces of a second, so that an unfinished file can be played as far as it got. Finishing writes
    the file again as a whole, with its index at the beginning. Width and height [pixels] are even; `rate` is in
    pictures per second. Methods raise FilmError if the file cannot be written.
    """

    def __init__(self, file: Path, width: int, height: int, rate: Fraction) -> None:
        self._file, self._count = file, 0
        self._error = ""
        try:
            with file.open("wb"):
                # The encoder opens the file only when it has data.
                pass
            self._container = av.open(str(file), "w", format="mp4", options=_PIECES)
            self._stream = self._added(rate)
        except (OSError, ValueError) as error:
            raise FilmError(f"cannot write the video {file}: {_reason(error)}") from None
        stream, coder = self._stream, self._stream.codec_context
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        coder.time_base = self._tick = 1 / rate
        coder.colorspace = coder.color_primaries = coder.color_trc = _BT709
        stream.gop_size, stream.thread_count = max(1, round(rate)), _THREADS

    def add(self, picture: NDArray[np.uint8]) -> None:
        """Add a picture (height, width, 3), sRGB."""
        given = av.VideoFrame.from_ndarray(picture, format="rgb24")
        frame = given.reformat(format="yuv420p", dst_colorspace=Colorspace.ITU709, dst_color_range=ColorRange.MPEG)
        frame.pts, frame.time_base = self._count, self._tick
        self._count += 1
        self._write(frame)

    def finish(self) -> int:
        """Write the remaining pictures, and the file again as a whole; return the number of pictures."""
        self._write(None)
        try:
            self._container.close()
            if self._count:
                _put_index_first(self._file)
        except OSError as error:
            self._fail(error)
        return self._count

    def _added(self, rate: Fraction) -> VideoStream:
        for codec in _CODECS:
            with contextlib.suppress(av.codec.codec.UnknownCodecError):
                stream = self._container.add_stream(codec, rate=rate, options=_QUALITY)
                assert isinstance(stream, VideoStream)
                return stream
        raise FilmError("cannot write a video: this PyAV supports neither H.264 nor MPEG-4")

    def _write(self, frame: av.VideoFrame | None) -> None:
        if self._error:  # the muxer is no longer reliable
            raise FilmError(self._error)
        try:
            for packet in self._stream.encode(frame):
                self._container.mux(packet)
        except OSError as error:  # the disk is full
            self._fail(error)

    def _fail(self, error: OSError) -> NoReturn:
        self._error = f"cannot write the video {self._file}: {_reason(error)}"
        raise FilmError(self._error) from None


def _put_index_first(file: Path) -> None:
    """Put the index of a video at its beginning. On failure the video stays as it is, and can be played."""
    new = file.with_name(f".{file.name}.new")
    try:
        with av.open(str(file)) as pieces, av.open(str(new), "w", format="mp4", options=_WHOLE) as whole:
            source = pieces.streams.video[0]
            target: Any = whole.add_stream_from_template(source)
            for packet in pieces.demux(source):
                if packet.dts is not None:
                    packet.stream = target
                    whole.mux(packet)
        new.replace(file)
    except (OSError, ValueError):
        new.unlink(missing_ok=True)


def _reason(error: BaseException) -> str:
    return getattr(error, "strerror", None) or " ".join(str(error).split())[:200]
