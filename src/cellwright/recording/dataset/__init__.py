"""Data sets: recorded runs as episodes for learning, with a row of numbers and pictures for each frame."""
