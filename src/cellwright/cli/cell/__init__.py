"""Command group `cellwright cell`: help in writing the file of a cell."""
