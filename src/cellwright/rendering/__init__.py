"""Rendering of scenes: pictures, cameras and videos."""
