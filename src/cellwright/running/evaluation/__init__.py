"""Evaluation of a program over many runs: a process for each run, results on disk, a report."""
