"""A node that is served by a thread beside, and can be taken down."""

from __future__ import annotations

import threading

from rclpy.executors import Executor, ExternalShutdownException


class BackgroundSpin:
    """Spins an executor in a thread of its own.

    An rclpy executor that is shut down while another thread spins it destroys what that thread is about to wait for,
    and the thread dies of it. Here it ends first.
    """

    def __init__(self, executor: Executor, name: str) -> None:
        self._executor = executor
        self._stopping = False
        self._thread = threading.Thread(target=self._spin, name=name, daemon=True)
        self._thread.start()

    def _spin(self) -> None:
        try:
            while not self._stopping and self._executor.context.ok():
                self._executor.spin_once()
        except ExternalShutdownException:
            pass

    def stop(self, patience_s: float = 5.0) -> None:
        """Let the callback under way end, then take the executor down; a thread that does not end is left behind.

        Args:
            patience_s: longest wait.
        """
        self._stopping = True
        self._executor.create_task(lambda: None)  # Wakes it.
        self._thread.join(patience_s)
        if not self._thread.is_alive():
            self._executor.shutdown()
