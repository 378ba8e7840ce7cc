"""Storage of a campaign in a folder.

| file | |
|---|---|
| ``campaign.yaml`` | copy of the campaign's file, for information |
| ``campaign.json`` | the manifest: study, seed, runs, software, digests of named files, columns |
| ``journal.db`` | SQLite: each row as soon as its flight ends; survives a killed process |
| ``journal.db.damaged`` | a damaged journal that was replaced |
| ``table.parquet`` | all rows in order, the same bytes with or without interruptions |
| ``table.parquet.sha256`` | digest of the table in the format of ``sha256sum`` |
| ``bags/`` | recorded flights: ``<run>_<law>`` |
"""
