"""Where the time goes: seconds and calls per phase."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from time import perf_counter

BEFORE_SOLVING = "linear solver's setup"  # orders and factorisations that the setup asks for


@dataclass
class Timer:
    """Seconds spent per phase, and how often; ``with timer("mesh"): ...`` books a phase, which
    ``entered`` hears of."""

    seconds: dict[str, float] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)
    entered: Callable[[str], None] = lambda name: None

    @contextmanager
    def __call__(self, name: str) -> Iterator[None]:
        """Book the time spent in the block under ``name``."""
        start = perf_counter()
        self.entered(name)
        try:
            yield
        finally:
            self.seconds[name] = self.seconds.get(name, 0.0) + perf_counter() - start
            self.counts[name] = self.counts.get(name, 0) + 1
