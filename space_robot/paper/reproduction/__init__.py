"""The paper's Table V and Figures 5 to 9, flown again: flights, table, claims, report."""
