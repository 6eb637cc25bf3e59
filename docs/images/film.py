"""Makes the films of docs/images with their posters: a frame of each as a picture.

To be run from the project's root, with the names of films or without. Without a GPU the lesson takes a few minutes.
"""

import subprocess
import sys
from fractions import Fraction

import av

CLONE = ("kitting/tasks/pick_from_bin.yaml", "--agent", "kitting.clone.agent:Clone", "--vary")
VIEW = "--video-camera=-1.5,-1.0,1.5:-0.1,0.1,0.9:45"
FILMS = {
    # the bundled agent does the lesson in 20 s; the frame in which a gear is taken off the belt
    "lesson": (274, ["lesson", "--video-speed", "2.3", "--video-camera=-2.4,1.0,3.1:0.75,1.0,0.6:56"]),
    # the clone takes a gear, at a third of the speed, and misses one
    "kitting-success": (100, [*CLONE, VIEW, "--seed", "100004", "--video-speed", "0.33"]),
    "kitting-failure": (100, [*CLONE, VIEW, "--seed", "100001", "--until", "6"]),
}
"""Films: the number of the poster's frame, and the words of the run."""


def main(names: list[str]) -> None:
    """Run each trial with a video, and take a frame of it."""
    for name in names or FILMS:
        shown, words = FILMS[name]
        film, poster = f"docs/images/{name}.mp4", f"docs/images/{name}.jpg"
        command = [sys.executable, "-m", "cellwright", "run", *words, "--no-picture", "--video", film]
        subprocess.run(command, check=False)  # noqa: S603 - our own words; a failure has another exit status
        with av.open(film) as video:
            frame = next(frame for number, frame in enumerate(video.decode(video=0)) if number == shown)
        with av.open(poster, "w", format="image2") as file:
            stream = file.add_stream("mjpeg", rate=Fraction(1), options={"qmin": "3", "qmax": "3"})
            stream.width, stream.height, stream.pix_fmt = frame.width, frame.height, "yuvj420p"
            picture = frame.reformat(format="yuvj420p")
            picture.pts = None
            file.mux([*stream.encode(picture), *stream.encode(None)])


if __name__ == "__main__":
    main(sys.argv[1:])
