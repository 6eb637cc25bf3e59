"""Helpers that know nothing of cells or robots: errors, poses, files, streams, plugins."""
