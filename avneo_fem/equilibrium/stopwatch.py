"""Where the time of a solve goes."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager

__all__ = ["PARTS", "Stopwatch"]

#: what is told apart; the rest of a solve is Python
PARTS = ("assembly", "factorization", "collision", "penalties")


class Stopwatch:
    """Seconds spent in each of :data:`PARTS`; parts must not be nested.

    Attributes
    ----------
    seconds : dict
        By part.
    """

    def __init__(self) -> None:
        self.seconds = dict.fromkeys(PARTS, 0.0)

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Count what is done inside towards ``name``."""
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] += time.perf_counter() - start
