"""What is kept of runs: on disk as it grows, readable whatever ends the program."""
