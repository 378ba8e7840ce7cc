"""Gains against reality: the margin and the noise that a gain set has on a robot and a mission.

`check` looks at gains there are, `tune` makes a set; neither flies anything.
"""
