"""Agents in a process of their own: the host of the cell, and the program of that process."""
