"""How readers say how far they are."""

from collections.abc import Callable

# Gets what is done and what there is in all, in whatever is counted: bytes or messages.
ProgressCallback = Callable[[int, int], None]
