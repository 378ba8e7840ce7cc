"""Reproduction of the paper's Table V and Figures 5 to 9: flights, table, claims, report."""
