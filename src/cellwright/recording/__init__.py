"""Recordings: written, replayed, plotted."""
