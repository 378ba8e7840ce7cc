"""Gain tuning: stability, margin and noise of gain sets for a robot and a mission, without flights.

| module | |
|---|---|
| `inertia` | the inertia H_S along a mission, and the postures of the nominal robot |
| `linear_law`, `closed_loop` | the linear part of a law, from its code; its loop on a rigid robot |
| `flexible` | the same loop with the springs of gears |
| `gain_check`, `warning` | the check of given gains, margins; remarks before a flight |
| `method` | a new set: `task` with the noise, `estimate_design`, `law_gains`; `gain_file` |
"""
