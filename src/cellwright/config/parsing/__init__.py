"""Text made safe: files as trees that know their lines, expressions, and problems told with their place."""
