"""How processes talk to a cell, frames over a stream of bytes, and how one is tied to the life of another.

Nothing here needs more than Python's standard library (3.8 or later): a bridge runs under an interpreter of its own,
which has nothing of Cellwright's installed, and loads this package as it stands.
"""
