"""Ctrl-C at a moment where it would do harm, and the end of whoever started this process."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Put Ctrl-C off until the block is over; only the main thread is interrupted.

    An interruption between taking and using a lock around a netCDF file would leave the lock taken for ever; a thread
    of a pool that starts meanwhile would never be told to end.
    """
    before = signal.getsignal(signal.SIGINT)
    if threading.current_thread() is not threading.main_thread() or before is None:
        yield
        return
    came = []
    signal.signal(signal.SIGINT, lambda *_: came.append(True))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
        if came:
            signal.raise_signal(signal.SIGINT)


def end_with_parent() -> None:
    """End this process when the one that started it is killed.

    An orphan would go on writing the restart file that the next run goes on from, and take the machine's time.
    """
    parent = os.getppid()

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.5)
        os.kill(os.getpid(), signal.SIGKILL)

    threading.Thread(target=watch, daemon=True).start()
