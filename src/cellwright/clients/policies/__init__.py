"""Policies: servers and programs that answer observations with actions, and the agent that lets one work a cell."""
