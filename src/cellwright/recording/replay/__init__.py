"""Replay: playback and verification of recordings, and their export and analysis."""
