"""The task of a trial in the cell: its start, its conditions and its reward."""
