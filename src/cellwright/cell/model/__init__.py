"""Model of the cell: turns a trial into an engine model, independent of time."""
