"""What somebody wrote about a cell, made safe: text in, frozen values with units out."""
