"""A node's logger that keeps its lines."""

from __future__ import annotations


class Lines:
    """Keeps what is logged; warnings are marked."""

    def __init__(self) -> None:
        self.lines: list[str] = []

    def info(self, message: str) -> None:
        self.lines.append(message)

    def warning(self, message: str) -> None:
        self.lines.append(f'WARN {message}')
