"""Programs in a process of their own: what hosts a cell for one, and what such a process does."""
