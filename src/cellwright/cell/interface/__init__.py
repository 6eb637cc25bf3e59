"""Interface of the kit-building cell of 2017: its table, and the bindings of each row to a device."""
