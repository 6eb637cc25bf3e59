"""A limit to what other nodes ask of this one: rospy reads a request of any length, and waits for it for ever."""

from __future__ import annotations

from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler

LONGEST = 1 << 20
"""Bytes of the longest request; those of nodes and masters have some hundreds."""

PATIENCE = 120.0
"""How long [s] a connection may say nothing; each has a thread of its own. Nodes leave theirs after half a minute."""


def limit_requests() -> None:
    """Have requests refused that say they are too long, or not how long, and silent connections closed."""
    post = SilenceableXMLRPCRequestHandler.do_POST

    def do_post(self: SilenceableXMLRPCRequestHandler) -> None:
        said = self.headers.get("content-length", "")
        if said.isascii() and said.isdigit() and len(said) < 10 and int(said) <= LONGEST:
            post(self)
            return
        self.close_connection = True  # what follows would be taken for another request
        self.send_error(413)

    SilenceableXMLRPCRequestHandler.do_POST = do_post
    SilenceableXMLRPCRequestHandler.timeout = PATIENCE
