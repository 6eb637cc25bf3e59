"""The contract of the kit-building cell of 2017: its table, and what binds each row to a device."""
