"""Storage of a campaign: a folder with ``study.yaml`` and one SQLite file, a row a flight.

| file | |
|---|---|
| ``study.yaml`` | copy of the campaign's file, for information |
| ``campaign.sqlite`` | each row as soon as its flight ends, and the manifest |
| ``bags/`` | recorded flights: ``<run>_<law>`` |
"""
