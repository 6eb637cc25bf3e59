"""Policies: servers and programs that answer observations with actions, and the agent that lets one work a cell."""

from cellwright.clients.policies.policy import Answer, Policy, PolicyAnswerError, PolicyConnectionError, PolicyError

__all__ = ["Answer", "Policy", "PolicyAnswerError", "PolicyConnectionError", "PolicyError"]
