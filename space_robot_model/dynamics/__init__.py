"""Rigid-body dynamics of a free-floating base with arms.

Compiled functions of a `Model` that write into preallocated arrays: `crba` (inertia matrix), `rnea`
(bias force), `aba` (accelerations), `rho_space` (in the coordinates of the laws).
"""
