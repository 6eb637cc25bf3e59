"""What figures show, read from a recording: a reader for each kind of thing, and one way through the file for all."""
