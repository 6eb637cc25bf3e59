"""Files of trials, robots and models: parsed, checked and turned into frozen values."""
