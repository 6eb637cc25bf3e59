"""Cell descriptions made safe: text in, frozen values with units out."""
