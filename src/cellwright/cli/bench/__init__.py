"""`cellwright bench`: what things cost on this machine."""
