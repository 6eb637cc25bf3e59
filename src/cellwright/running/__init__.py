"""Runs and evaluations: one agent, one cell, one result, here or in other processes."""
