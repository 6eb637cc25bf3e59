"""Tables of topics and services: names, types, rates, latches."""
