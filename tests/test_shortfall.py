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
from avneo_fem.stages.suturing import CuspSuturing

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
    """A cusp of Experiment 1, clearances to be kept to 0.01 mm."""
    scene = parse_scene({"mesh": {"size": 2.0}, "solver": {"inside_tolerance": 0.02}})
    given = ValveInput.from_scene(scene)
    mesh = nested_meshes(given.geometry.cusps[0].template, 2.0, 0, False)[-1]
    return CuspSetup(scene, given.geometry, given.wedges, 0, mesh)


def test_large_triangles_are_moved_off_a_bend() -> None:
    """Truth: where the chord of an inner edge cuts more than half of its clearance into a ball on
    which its ends keep theirs, both ends are told by how much; a chord of a larger ball is not."""
    setup = made()
    mesh = setup.mesh
    held = np.r_[mesh.suture_line, setup.row.nodes]
    edge = next(e for e in mesh.edges if not np.isin(e, held).any())
    clearance = setup.wedge_clearance[edge].mean()
    for share, told in ((0.4, False), (0.6, True)):
        # half the length s and sagitta c: a circle of radius (s^2 + c^2) / 2c
        half, cut = 1.0, share * clearance
        radius = (half**2 + cut**2) / (2.0 * cut)
        points = np.full((len(mesh.points), 3), 50.0)
        points[edge] = [[-half, 0.0, radius - cut], [half, 0.0, radius - cut]]
        setup.wedge.field = OutsideBall(np.zeros(3), radius - clearance)  # type: ignore[assignment]
        found = bulging(setup, points)
        assert found[edge] == pytest.approx(np.full(2, cut * told), abs=1e-9)
        assert np.count_nonzero(found) == 2 * told


@pytest.mark.parametrize(("half", "cut"), [(1.0, 0.4), (15.0, 4.0)])
def test_moved_off_by_half_a_usual_edge_at_most(half: float, cut: float) -> None:
    """Truth: ends of an edge that cuts c into a bend are asked for c more clearance, or for half
    of the median edge, 1 mm here, if that is less: not for half of their own edge of 30 mm."""
    setup = made()
    mesh = setup.mesh
    held = np.r_[mesh.suture_line, setup.row.nodes]
    edge = next(e for e in mesh.edges if not np.isin(e, held).any())
    radius = (half**2 + cut**2) / (2.0 * cut)
    points = np.column_stack([mesh.points + 200.0, np.zeros(len(mesh.points))])
    points[edge] = [[-half, 0.0, radius - cut], [half, 0.0, radius - cut]]
    before = setup.wedge.clearance
    clearance = before[edge].mean()
    setup.wedge.field = OutsideBall(np.zeros(3), radius - clearance)  # type: ignore[assignment]
    lengths = np.linalg.norm(np.diff(mesh.points[mesh.edges], axis=1), axis=2)
    usual = float(np.median(lengths))
    suturing = CuspSuturing(setup, lambda _index, _record: None)
    assert suturing._keep_off(points)
    asked = setup.wedge.clearance - before
    assert asked[edge] == pytest.approx(min(cut, usual / 2), rel=0.05)
    assert asked.max() == asked[edge].max()


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
