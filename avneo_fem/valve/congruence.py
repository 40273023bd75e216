"""Cusps that are the same but for a turn about the axis are solved once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from avneo_fem.geometry.contact_wedge import ContactWedgeFamily
from avneo_fem.geometry.valve_geometry import ValveGeometry
from avneo_fem.scene import Scene
from avneo_fem.stages.record import CuspResult, Snapshot

__all__ = ["representatives", "rotate_result", "to_its_place"]

Floats = NDArray[np.float64]


def _turn(geometry: ValveGeometry, source: int, copy: int) -> Floats:
    """(3, 3) rotation about z that takes the suture line of ``source`` to that of ``copy``."""
    lines = [geometry.cusps[i].suture_line for i in (source, copy)]
    return _rotation(lines[1].start_angle - lines[0].start_angle)


def _rotation(angle: float) -> Floats:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _congruent(
    scene: Scene, geometry: ValveGeometry, wedges: ContactWedgeFamily, source: int, copy: int
) -> bool:
    if scene.cusp[source] != scene.cusp[copy]:
        return False
    first, second = (geometry.cusps[i].suture_line for i in (source, copy))
    turn, scale = _turn(geometry, source, copy), geometry.root.radius
    if not np.isclose(first.length, second.length, rtol=1e-12):
        return False
    share = np.linspace(0.0, 1.0, 9)
    pairs = [(first.point(share * first.length), second.point(share * second.length))]
    plane = geometry.commissures.points
    for step in range(3):
        pairs.append((plane[[(source + step) % 3]], plane[[(copy + step) % 3]]))
    for lam in (0.0, 0.5, 1.0):
        curves = [wedges.wedge(i, lam).polyline3(9, scale) for i in (source, copy)]
        pairs.append((curves[0], curves[1]))
    return all(np.abs(a @ turn.T - b).max() < 1e-9 * scale for a, b in pairs)


def representatives(
    scene: Scene, geometry: ValveGeometry, wedges: ContactWedgeFamily
) -> tuple[int, int, int]:
    """For each cusp the lowest index of a cusp it is congruent with (itself, if of none)."""
    found = [0, 1, 2]
    for copy in (1, 2):
        for source in range(copy):
            if found[source] == source and _congruent(scene, geometry, wedges, source, copy):
                found[copy] = source
                break
    return found[0], found[1], found[2]


def rotate_result(geometry: ValveGeometry, result: CuspResult, copy: int) -> CuspResult:
    """The result of a congruent cusp, turned to cusp ``copy``."""
    turned = _turned(result, _turn(geometry, result.index, copy), copy)
    return replace(turned, copied_from=result.index, compile_seconds=0.0, seconds=0.0)


def to_its_place(own: ValveGeometry, geometry: ValveGeometry, result: CuspResult) -> CuspResult:
    """A result that was found as cusp 0 of ``own``, turned to its place in ``geometry``."""
    turn = _rotation(
        geometry.cusps[result.index].suture_line.start_angle - own.cusps[0].suture_line.start_angle
    )
    return _turned(result, turn, result.index)


def _turned(result: CuspResult, turn: Floats, index: int) -> CuspResult:
    snapshots = [
        Snapshot(shot.name, shot.parameter, shot.points @ turn.T, shot.fields)
        for shot in result.snapshots
    ]
    return replace(result, index=index, points=result.points @ turn.T, snapshots=snapshots)
