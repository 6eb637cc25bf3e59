"""Safe parsing: files as trees that know their lines, expressions, and problems with their place."""
