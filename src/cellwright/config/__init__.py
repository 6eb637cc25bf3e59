"""Files of trials, robots and models: parsed, checked, turned into frozen values."""
