"""The folder of a campaign.

| file | |
|---|---|
| ``campaign.yaml`` | the campaign's file as it was read |
| ``campaign.json`` | the manifest: seed, runs, software, digests of what the file names, columns |
| ``journal.db`` | SQLite: a row as it ends; what is in it survives whatever kills the campaign |
| ``table.parquet`` | all rows in their order, the same bytes whatever happened on the way |
| ``bags/`` | flights that were kept: ``<run>_<law>`` |
"""
