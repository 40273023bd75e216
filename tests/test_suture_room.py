"""A contact surface that passes behind the suture line of its own cusp is refused."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.extremes.shaping import chords_by_angles, proportioned
from avneo_fem.geometry.suture_room import narrow_room_warning
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.results.forewarnings import forewarnings
from avneo_fem.scene import parse_scene

_ANGLES = (110.0, 35.0, 35.0)


def _narrow(alpha: float, **contact: object) -> ValveInput:
    """Cusps of L_f = alpha a in a root whose commissures form a flat triangle."""
    belly = [{"suture_line.belly_depth": d} for d in (10.0, 5.8, 5.8)]
    chords = chords_by_angles(*_ANGLES)
    entries = proportioned({"commissures.chord_ratio": chords, "cusp": belly}, alpha, 0.7)
    cusps = []
    for cusp in entries["cusp"]:
        tables: dict[str, dict[str, float]] = {"template": {}, "suture_line": {}}
        for key, value in cusp.items():
            table, name = key.split(".")
            tables[table][name] = value
        cusps.append(tables)
    return ValveInput.from_scene(
        parse_scene({"commissures": {"chord_ratio": chords}, "cusp": cusps, "contact": contact})
    )


def test_large_cusps_beside_a_flat_angle_are_refused() -> None:
    """Truth: at L_f = 1.5 a the contact curve of narrow cusp 1 bulges out by more than the
    segment between its chord and the wall is high, R (1 - cos 35 deg) = 2.2 mm."""
    with pytest.raises(SceneError, match=r"of cusp 1 passes behind its suture line by 1\.\d+ mm"):
        _narrow(1.5)


def test_smaller_cusps_or_planes_have_room() -> None:
    """Truth: near L_f = a contact curves are straight, chords of the root; so are half-planes."""
    _narrow(1.2)
    _narrow(1.5, method="virtual_planes")


def _experiment_2(thickness: float) -> ValveInput:
    factors = (1.5, 1.0, 1.25)
    cusps = [{"template": {"free_edge_length": 39 * g, "belly_radius": 16.5 * g}} for g in factors]
    scene = {
        "commissures": {"chord_ratio": [8.0, 9.0, 6.0]},
        "template": {"thickness": thickness},
        "cusp": cusps,
    }
    return ValveInput.from_scene(parse_scene(scene))


def test_experiments_have_room() -> None:
    """Truth: the paper sutures Experiment 2, whose free edges are as unequal as 3 : 2."""
    _experiment_2(0.5)


def test_narrow_room() -> None:
    """Truth: by brute force along the wall, the contact surface of cusp 0 of Experiment 2 leaves
    0.46 mm between two places with several mm; a sheet of 0.4 mm has room, that of 0.5 mm has not,
    and Experiment 1 has no narrow place."""
    given = _experiment_2(0.5)
    around = np.radians(np.linspace(150.0, 195.0, 4001))
    wall = np.column_stack([12 * np.cos(around), 12 * np.sin(around), np.full(4001, -5.0)])
    room = given.wedges.wedge(0, 1.0).signed_distance(wall)
    least = int(np.argmin(room))
    told = narrow_room_warning(given.geometry, given.wedges)
    assert told is not None
    assert told.startswith(f"the contact surface of cusp 0 passes {room[least]:.2f} mm from the")
    assert f" {np.degrees(around[least]):.0f} degrees," in told
    assert forewarnings(given) == [told]
    assert forewarnings(_experiment_2(0.4)) == []
    assert forewarnings(ValveInput.from_scene(parse_scene({}))) == []
