"""Rigid-body dynamics of a free-floating base with a serial arm.

Compiled functions of a `Model` that write into given arrays: `crba` (the inertia matrix), `rnea`
(the bias force), `aba` (accelerations), in the coordinates of the laws `rho_space`.
"""
