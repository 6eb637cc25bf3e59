"""Programs that work a cell through a client."""
