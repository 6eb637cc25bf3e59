"""A server with the scene services, for tests of the page's connection."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from cellwright.middleware.server import Server
from cellwright.viewer.services.scene import SceneServices, ServedScene, ViewedNode


@contextmanager
def hosted(served: ViewedNode, port: int = 0, *, steps: bool = False) -> Iterator[Server]:
    """Server in a thread of its own, where no time passes unless `steps`."""
    server = Server(served, port=port)
    SceneServices(ServedScene(served)).offer(server)
    is_over = threading.Event()

    def serve() -> None:
        while not is_over.is_set():
            server.wait(0.005)
            if steps:
                served.simulation.step()

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield server
    finally:
        is_over.set()
        thread.join()
        server.close("the end")
