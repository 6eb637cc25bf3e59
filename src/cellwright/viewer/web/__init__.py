"""Web page for a cell, robot or recording, in its own process; it polls the server."""
