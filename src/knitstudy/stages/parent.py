"""A process that does not outlive the one that started it."""

from __future__ import annotations

import os
import signal
import threading
import time


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
