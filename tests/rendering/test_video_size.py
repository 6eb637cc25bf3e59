"""Choice of a video's size by the time of its first frames."""

import pytest

from cellwright.rendering.video_size import LONGEST, QUALITIES, FrameQuality, choose_quality, smallest_quality


class Machine:
    """Machine that needs some time for each sample, and more for the first frame of a size."""

    def __init__(self, per_sample: float) -> None:
        self.now = 0.0
        self.drawn: list[FrameQuality] = []
        self._per_sample = per_sample

    def draw(self, quality: FrameQuality) -> None:
        self.now += 1.0 if quality not in self.drawn else 0.0
        self.now += self._per_sample * quality.size[0] * quality.size[1] * quality.samples**2
        self.drawn.append(quality)


def test_quick_machine_keeps_default_without_a_word() -> None:
    machine = Machine(1e-9)
    chosen = choose_quality(machine.draw, clock=lambda: machine.now)
    assert (chosen.quality, chosen.reason) == (QUALITIES[0], "")
    assert machine.drawn == [QUALITIES[0]] * 2


@pytest.mark.parametrize("per_sample", [6e-8, 9e-8, 1.5e-7])
def test_slow_machine_gets_largest_size_that_is_drawn_in_time(per_sample: float) -> None:
    machine = Machine(per_sample)
    chosen = choose_quality(machine.draw, clock=lambda: machine.now)
    times = {each: per_sample * each.size[0] * each.size[1] * each.samples**2 for each in QUALITIES}
    assert chosen.quality == next(each for each in QUALITIES if times[each] <= LONGEST)
    assert chosen.reason == (
        f"{chosen.quality.size[0]}x{chosen.quality.size[1]}, since a frame of 1280x720 takes "
        f"{times[QUALITIES[0]]:.2f} s here"
    )


def test_slowest_machine_gets_smallest_size() -> None:
    machine = Machine(1e-5)
    assert choose_quality(machine.draw, clock=lambda: machine.now).quality == QUALITIES[-1]
    assert smallest_quality("it is slow").reason == "480x270, since it is slow"


def test_requested_samples_are_kept_at_each_size() -> None:
    machine = Machine(5e-8)
    chosen = choose_quality(machine.draw, samples=3, clock=lambda: machine.now)
    assert {each.samples for each in machine.drawn} == {3}
    assert chosen.quality.size < (1280, 720)


def test_sizes_fit_the_codec_and_have_one_shape() -> None:
    assert all(side % 2 == 0 for each in QUALITIES for side in each.size)
    assert {each.size[0] * 9 == each.size[1] * 16 for each in QUALITIES} == {True}
