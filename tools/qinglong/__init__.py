"""The description of the QingLong that comes along, and how it is made.

`python -m tools.qinglong` writes it again, from figures (kinematics, limits, masses) and from
shapes drawn around them.
"""
