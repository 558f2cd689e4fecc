"""What the demo says while it runs: a line a phase, a bar where a person looks on."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn


class DemoConsole:
    """Prints phases with the seconds since the start; bars only on a terminal."""

    def __init__(self) -> None:
        self.rich = Console(highlight=False, soft_wrap=True)
        self._start = time.monotonic()

    @property
    def seconds(self) -> float:
        """Seconds since the start (steady time)."""
        return time.monotonic() - self._start

    def say(self, text: str) -> None:
        self.rich.print(f'[dim]{self.seconds:5.1f} s[/dim]  {text}')

    @contextmanager
    def bar(self, text: str, total: int) -> Iterator[Bar]:
        """A progress bar that leaves one line behind."""
        progress = Progress(
            TextColumn('         {task.description}'), BarColumn(), TextColumn('{task.completed:.0f}/{task.total:.0f}'),
            TimeElapsedColumn(), console=self.rich, transient=True, disable=not self.rich.is_terminal,
        )
        with progress:
            yield Bar(progress, progress.add_task(text, total=total))


class Bar:
    """One running bar."""

    def __init__(self, progress: Progress, task: TaskID) -> None:
        self._progress, self._task = progress, task

    def at(self, done: float) -> bool:
        """Move the bar; returns True so that it can stand in a waiting predicate."""
        self._progress.update(self._task, completed=done)
        return True
