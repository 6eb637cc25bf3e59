"""Hands and grippers: poses of the tips, and the joints that open and close."""
