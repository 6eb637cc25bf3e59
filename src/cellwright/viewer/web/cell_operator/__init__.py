"""Working the arms of a cell from its page: handles, controls, keys and gamepads, for the operator agent."""
