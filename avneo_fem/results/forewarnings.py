"""What makes a scene doubtful before anything is solved."""

from __future__ import annotations

from avneo_fem.geometry.suture_room import narrow_room_warning
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.inflation import inflation_warning

__all__ = ["forewarnings"]


def forewarnings(given: ValveInput) -> list[str]:
    """A line each, for ``avneo check`` and ``suture``, and beside the reasons of a failure."""
    told = inflation_warning(given.scene), narrow_room_warning(given.geometry, given.wedges)
    return [text for text in told if text is not None]
