"""Where the page is served."""

from __future__ import annotations

import socket

from advise_ros.core.errors import InputError

HOST = '127.0.0.1'


def bind(port: int, remedy: str = '-p port:=N') -> socket.socket:
    """A socket on the local host; port 0 takes any that is free.

    Args:
        port: TCP port.
        remedy: how another one is named.

    Raises:
        InputError: somebody else has it.
    """
    bound = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        bound.bind((HOST, port))
        bound.listen()  # Who comes before the server is up waits, and is not turned away.
    except OSError as problem:
        bound.close()
        reason = f"parameter 'port' is {port}, which cannot be used on {HOST} ({str(problem.strerror).lower()})"
        raise InputError(f'{reason}; end the other program, or name another port by {remedy}, or 0 for any') from None
    return bound
