"""A flight as a row: metrics, requirements in their windows, bands over time, and a digest.

| module | |
|---|---|
| `columns` | the columns of Table V of a flight, and the names of the metrics that rows have |
| `window` | metrics of the ticks within a window |
| `bands` | the largest size of each column, over time |
| `measure` | a flight's blocks to all numbers of its row |
| `row` | the row itself, and its digest |
| `fly` | one run of a campaign, flown in this process to its row |
"""
