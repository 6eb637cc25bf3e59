"""Bridges carry a cell's bus onto a real middleware and back: they pass bytes on, and decide nothing.

A bridge is a process under an interpreter of its own, which need not have anything of Cellwright's installed. It
attaches to the cell's socket like any other guest (`cellwright.middleware.wire`), and nothing else is imported there.
"""
