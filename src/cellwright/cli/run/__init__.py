"""Command `cellwright run`: one run of a trial, and its output for people and programs."""
