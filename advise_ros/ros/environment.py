"""What ROS reads from the environment, refused in words where rcl would end with a traceback."""

from __future__ import annotations

import os
from pathlib import Path

from advise_ros.core.errors import InputError

# Above this DDS runs out of port numbers.
DOMAIN_MAX = 232


def check() -> None:
    """Look at ROS_DOMAIN_ID and at where ROS will write its logs.

    Raises:
        InputError: rcl could not start with them; names the variable, its value and the remedy.
    """
    _check_domain(os.environ.get('ROS_DOMAIN_ID', ''))
    _check_log_directory()


def _check_domain(domain: str) -> None:
    if domain and not (domain.isascii() and domain.isdigit() and int(domain) <= DOMAIN_MAX):
        raise InputError(
            f'ROS_DOMAIN_ID is {domain!r}; it must be a whole number from 0 to {DOMAIN_MAX}, the same for all that are to meet'
        )


def _check_log_directory() -> None:
    """The directory that rcl_logging takes: ROS_LOG_DIR, ROS_HOME/log or ~/.ros/log."""
    remedy = 'set ROS_LOG_DIR to a directory that you may write'
    named, home = os.environ.get('ROS_LOG_DIR'), os.environ.get('ROS_HOME')
    if not (named or home or os.environ.get('HOME')):
        raise InputError(f'ROS has no place for its logs: HOME is not set; {remedy}')
    directory = Path(named or (Path(home) / 'log' if home else '~/.ros/log')).expanduser()
    try:
        directory.mkdir(parents=True, exist_ok=True)
        problem = '' if os.access(directory, os.W_OK) else 'it may not be written'
    except OSError as refused:
        problem = str(refused.strerror)
    if problem:
        raise InputError(f"ROS cannot write its logs into '{directory}': {problem}; {remedy}")
