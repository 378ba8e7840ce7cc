"""Gain tuning: stability margin and noise of gain sets for a robot and a mission, without flights.

`gain_check` checks existing gains, `method` computes a new set.
"""
