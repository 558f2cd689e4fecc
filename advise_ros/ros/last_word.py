"""A last word by DDS when a signal ends the process: rclpy's own handlers end the context first, and nothing goes out then."""

from __future__ import annotations

import signal
from collections.abc import Callable

import rclpy
from rclpy.signals import uninstall_signal_handlers


def before_the_end(say: Callable[[], object]) -> None:
    """Have something published on SIGINT and SIGTERM before ROS ends.

    Python runs its handlers between two steps of the executor, so this is for a node with a quick timer, in its main thread.

    Args:
        say: called once.
    """
    watched = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) is not signal.SIG_IGN]
    uninstall_signal_handlers()

    def leave(*_: object) -> None:
        for number in watched:
            signal.signal(number, signal.SIG_IGN)
        say()
        rclpy.try_shutdown()

    for number in watched:
        signal.signal(number, leave)
