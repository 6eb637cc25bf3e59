"""Long runs of cell and robot in one process: steady memory, and equal states with and without restores."""
