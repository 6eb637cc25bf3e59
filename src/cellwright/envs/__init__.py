"""Environments for learning: cells with a task, under the interface of Gymnasium."""
