"""Threads that wait for a disk: a test's folder may go once they have ended."""

import threading

from gateway.processes.disk_worker import THREAD_NAME


def join_disk_threads(bound_s: float = 10.0) -> int:
    """Wait for the threads of every closed `DiskWorker`; return how many there were."""
    threads = [thread for thread in threading.enumerate() if thread.name.startswith(THREAD_NAME)]
    for thread in threads:
        thread.join(bound_s)
        assert not thread.is_alive(), f"{thread.name} still waits for the disk after {bound_s:g} s"
    return len(threads)
