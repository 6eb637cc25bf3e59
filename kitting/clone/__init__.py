"""Behaviour cloning with NumPy alone: samples of demonstrations, a network, its training, and the agent."""
