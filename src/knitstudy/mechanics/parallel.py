"""Which part of the work threads share: batches of elements and yarns, never the inside of a matrix product."""

import os
from contextlib import AbstractContextManager

from threadpoolctl import threadpool_limits


def threads() -> int:
    """Return the number of threads that OMP_NUM_THREADS allows, all cores if it is unset."""
    return int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1)


def serial_blas() -> AbstractContextManager:
    """Return a context in which BLAS stays on the calling thread.

    Its matrices are small here, and its threads would wait in a busy loop for those that share the batches.
    """
    return threadpool_limits(limits=1, user_api="blas")
