"""Run many items: in this process, in worker processes, or on a Dask cluster."""

from .cluster import check_scheduler
from .done import Done, OutOfTimeError, WorkerDiedError
from .run import cores, run_all, run_many

__all__ = [
    "Done",
    "OutOfTimeError",
    "WorkerDiedError",
    "check_scheduler",
    "cores",
    "run_all",
    "run_many",
]
