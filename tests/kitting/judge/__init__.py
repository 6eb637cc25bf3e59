"""The description of the benchmark's data before the reader of Croissant's own makers."""
