"""A recording as a file for the tools of others: what was said, and what was to be seen in messages that they know."""
