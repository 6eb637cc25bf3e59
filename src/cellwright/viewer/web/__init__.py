"""A page in a browser on whatever is served: a process of its own, which asks for what it shows."""
