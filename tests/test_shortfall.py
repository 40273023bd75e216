"""How far a cusp is from its clearances, at nodes and between them."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.refine import nested_meshes
from avneo_fem.scene import parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.shortfall import bulging, shortfalls

Floats = NDArray[np.float64]


class OutsideBall:
    """Everything outside a ball."""

    def __init__(self, centre: Floats, radius: float) -> None:
        self.centre, self.radius = centre, radius

    def evaluate(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        arm = points - self.centre
        distance = np.linalg.norm(arm, axis=1)
        normal = arm / distance[:, None]
        return distance - self.radius, normal, np.zeros((len(points), 3, 3))


def made() -> CuspSetup:
    """A cusp of Experiment 1, whose nodes must keep their clearances to 0.01 mm."""
    scene = parse_scene({"mesh": {"size": 2.0}, "solver": {"inside_tolerance": 0.02}})
    given = ValveInput.from_scene(scene)
    mesh = nested_meshes(given.geometry.cusps[0].template, 2.0, 0, False)[-1]
    return CuspSetup(scene, given.geometry, given.wedges, 0, mesh)


def test_large_triangles_are_held_off_a_bend() -> None:
    """Truth: the chord of an inner edge that cuts c into a ball on which its ends keep their
    clearance misses c over half of that; once held off, it counts as much as nodes do."""
    setup = made()
    mesh = setup.mesh
    held = np.r_[mesh.suture_line, setup.row.nodes]
    number = next(n for n, e in enumerate(mesh.edges) if not np.isin(e, held).any())
    edge = mesh.edges[number]
    clearance = setup.wedge.clearance[edge].mean()
    for share in (0.4, 0.6):
        # half the length s and sagitta c: a circle of radius (s^2 + c^2) / 2c
        half, cut = 1.0, share * clearance
        radius = (half**2 + cut**2) / (2.0 * cut)
        points = np.full((len(mesh.points), 3), 50.0)
        points[edge] = [[-half, 0.0, radius - cut], [half, 0.0, radius - cut]]
        setup.wedge.field = OutsideBall(np.zeros(3), radius - clearance)  # type: ignore[assignment]
        found = bulging(setup, points)
        assert found[number] == pytest.approx(2 * share, abs=1e-7)
        assert np.count_nonzero(found) == 1
        for which, expected in ((found > 5.0, 0.0), (found > 0.5, 2 * share * 0.01)):
            setup.between.hold_off(which)
            assert shortfalls(setup, points)[1] == pytest.approx(expected, abs=1e-5)


def test_little_clearance_weighs_more() -> None:
    """Truth: a node may miss its clearance by 0.01 mm, or by half of it where that is less."""
    setup = made()
    node = int(np.setdiff1d(np.arange(len(setup.mesh.points)), setup.mesh.suture_line)[-1])
    points = np.full((len(setup.mesh.points), 3), 50.0)
    points[node] = [2.0, 0.0, 0.0]
    for clearance, missed, expected in ((0.25, 0.004, 0.004), (0.008, 0.004, 0.01)):
        setup.wedge.clearance = np.full(len(points), clearance)
        radius = 2.0 - clearance + missed
        setup.wedge.field = OutsideBall(np.zeros(3), radius)  # type: ignore[assignment]
        assert shortfalls(setup, points)[1] == pytest.approx(expected, rel=1e-9)
