"""Operators: drive a robot controller node from a keyboard, with a test signal, or from a file."""
