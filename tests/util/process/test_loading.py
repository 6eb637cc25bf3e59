import signal
import threading
from collections.abc import Iterator

import pytest

from cellwright.util.process import silent_ctrl_c


@pytest.fixture(autouse=True)
def _restore_handler() -> Iterator[None]:
    before = signal.getsignal(signal.SIGINT)
    yield
    signal.signal(signal.SIGINT, before)


def test_ctrl_c_ends_process_during_loading() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with silent_ctrl_c():
        assert signal.getsignal(signal.SIGINT) is signal.SIG_DFL
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_failed_loading_restores_ctrl_c_handler() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    with pytest.raises(ImportError), silent_ctrl_c():
        raise ImportError
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("own", [signal.SIG_IGN, signal.SIG_DFL, lambda _number, _frame: None])
def test_handler_of_caller_stays(own: signal.Handlers) -> None:
    signal.signal(signal.SIGINT, own)
    with silent_ctrl_c():
        assert signal.getsignal(signal.SIGINT) is own
    assert signal.getsignal(signal.SIGINT) is own


def test_loading_in_thread_keeps_handler() -> None:
    signal.signal(signal.SIGINT, signal.default_int_handler)
    found: list[object] = []

    def load() -> None:
        with silent_ctrl_c():
            found.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=load)
    thread.start()
    thread.join()
    assert found == [signal.default_int_handler]
