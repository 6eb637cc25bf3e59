"""Agent that waits for a while and ends the competition."""

import logging

from cellwright.clients.client import Client

log = logging.getLogger(__name__)


class Watchman:
    """Reads the sensor `counter` after two seconds."""

    def run(self, client: Client) -> None:
        """Work the cell."""
        client.start_competition()
        counter = client.sensor("counter")
        client.sleep(2.0)
        assert counter.message is not None
        log.info("%g parts in bin 7", counter.message.data)
        client.end_competition()
