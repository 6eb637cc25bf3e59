"""Makes docs/images/lesson.mp4 and its poster lesson.jpg: the bundled agent does the lesson, in 20 s.

To be run from the project's root. Without a GPU it takes a few minutes.
"""

import subprocess
import sys
from fractions import Fraction

import av

VIDEO, POSTER = "docs/images/lesson.mp4", "docs/images/lesson.jpg"
CAMERA = "-2.4,1.0,3.1:0.75,1.0,0.6:56"
SHOWN = 274  # the frame in which a gear is taken off the belt


def main() -> None:
    """Run the trial with a video, and take a frame of it."""
    options = ["--video", VIDEO, "--video-speed", "2.3", f"--video-camera={CAMERA}"]
    command = [sys.executable, "-m", "cellwright", "run", "lesson", "--no-picture", *options]
    subprocess.run(command, check=True)  # noqa: S603
    with av.open(VIDEO) as video:
        frame = next(frame for number, frame in enumerate(video.decode(video=0)) if number == SHOWN)
    with av.open(POSTER, "w", format="image2") as file:
        stream = file.add_stream("mjpeg", rate=Fraction(1), options={"qmin": "3", "qmax": "3"})
        stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, "yuvj420p"
        picture = frame.reformat(format="yuvj420p")
        picture.pts = None
        file.mux([*stream.encode(picture), *stream.encode(None)])


if __name__ == "__main__":
    main()
