"""Outputs of an evaluation: report, page, pictures, tables, and logs in trackers."""
