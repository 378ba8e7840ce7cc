"""Rows of a campaign's table: metrics, requirements in windows, bands over time, a digest.

| module | |
|---|---|
| `columns` | the columns of Table V of a flight, and the names of a row's metrics |
| `window` | metrics of the ticks within a time window |
| `bands` | the largest magnitude of each column, over time |
| `measure` | evaluates a flight block by block |
| `row` | the row and its digest |
| `fly` | flies one run of a campaign in this process |
"""
