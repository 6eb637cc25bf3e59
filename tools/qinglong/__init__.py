"""Generator of the bundled description of the QingLong.

`python -m tools.qinglong` writes it from figures (kinematics, limits, masses) and from shapes drawn around them.
"""
