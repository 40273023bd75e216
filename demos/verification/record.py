"""One line of the verification table: a computed value against the one it must reproduce."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Row"]


@dataclass(frozen=True)
class Row:
    """A benchmark's answer.

    Attributes
    ----------
    benchmark, case, quantity : str
        What was computed, on which mesh and degree, and which figure of it this is.
    value, target : float
        Computed, and published or exact.
    tolerance : float
        Largest |value - target| allowed, relative to |target| unless ``absolute``.
    source : str
        Where the target comes from.
    """

    benchmark: str
    case: str
    quantity: str
    value: float
    target: float
    tolerance: float
    source: str
    absolute: bool = False

    @property
    def error(self) -> float:
        """Error as ``tolerance`` counts it."""
        scale = 1.0 if self.absolute else abs(self.target)
        return abs(self.value - self.target) / scale

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance (NaN is not)."""
        return self.error <= self.tolerance
