"""The folder of a campaign.

| file | |
|---|---|
| ``campaign.yaml`` | the campaign's file as it was read, for the reader |
| ``campaign.json`` | the manifest: study, seed, runs, software, digests of named files, columns |
| ``journal.db`` | SQLite: a row as it ends; what is in it survives whatever kills the campaign |
| ``journal.db.damaged`` | a journal that was damaged, without which the campaign goes on |
| ``table.parquet`` | all rows in their order, the same bytes whatever happened on the way |
| ``table.parquet.sha256`` | digest of the table, as ``sha256sum`` writes it |
| ``bags/`` | flights that were kept: ``<run>_<law>`` |
"""
