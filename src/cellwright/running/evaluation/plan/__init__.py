"""Runs of an evaluation: trials, seeds and programs, and the key of each run."""
