"""Tables that give devices their public names, types, rates and rules."""
