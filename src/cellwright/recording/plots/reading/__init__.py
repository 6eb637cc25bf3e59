"""Plot data read from a recording: a reader for each kind of data, and one pass over the file for all."""
