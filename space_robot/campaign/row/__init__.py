"""Rows of a campaign's table: metrics, requirements in windows, bands over time, a digest.

| module | |
|---|---|
| `bands` | the largest magnitude of each column, over time |
| `measure` | the metrics of a row, and those that are required |
| `row` | the row and its digest |
| `fly` | flies one run of a campaign in this process |
"""
