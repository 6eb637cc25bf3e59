"""Fixtures for tests of pages."""

from tests.warm import warm

__all__ = ["warm"]
