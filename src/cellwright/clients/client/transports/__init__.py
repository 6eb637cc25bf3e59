"""Ways from a client to a cell."""
