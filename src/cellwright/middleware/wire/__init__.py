"""Wire protocol: frames over a stream of bytes; and programs that tie a process to the life of another.

Nothing here needs more than Python's standard library (3.8 or later). A bridge runs under another interpreter, which
has nothing of Cellwright installed, and loads this package from its folder.
"""
