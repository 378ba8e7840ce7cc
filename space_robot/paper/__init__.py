"""The paper flown again: its Table V with figures and claims, and its stability analysis.

| module | content |
|---|---|
| `flights` | printed numbers; a row of the table in flight |
| `reproduce` | measured against printed; folder with tables, figures, report |
| `lyapunov` | circle criterion (72)-(77), the LMI (51), the reaching time (56) |
| `stability` | flights of a study, and the conditions that they meet |
| `stability_report`, `stability_figures` | a study as JSON, tables and figures |
"""
