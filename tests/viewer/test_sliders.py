import numpy as np

from cellwright.viewer.window_program import Sliders


def test_what_somebody_moved() -> None:
    sliders = Sliders(["pan", "tilt", "lift"])
    assert sliders.moved(np.array([1.0, 2.0, 3.0])) == {}, "they have not been set yet"
    shown = sliders.set(np.array([0.1, 0.2, 0.3]))
    assert sliders.moved(shown) == {}
    assert sliders.moved(np.array([0.1, 0.5, 0.3])) == {"tilt": 0.5}
    sliders.set(np.array([0.1, 0.5, 0.3]))
    assert sliders.moved(np.array([0.1, 0.5, 0.3])) == {}, "the node has taken it"


def test_the_robot_moves_them_too() -> None:
    sliders = Sliders(["pan"])
    sliders.set(np.array([0.1]))
    assert sliders.set(np.array([0.7])).tolist() == [0.7]
    assert sliders.moved(np.array([0.7])) == {}
