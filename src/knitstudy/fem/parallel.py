"""How many threads may share the work of one process."""

import os


def threads() -> int:
    """Return the number of threads that OMP_NUM_THREADS allows, all cores if it is unset."""
    return int(os.environ.get("OMP_NUM_THREADS") or os.cpu_count() or 1)
