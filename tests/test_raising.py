"""By how much penalties are raised."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.refine import nested_meshes
from avneo_fem.scene import parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.raising import PenaltyRaising, raising_factor

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


def raising() -> PenaltyRaising:
    """The end of the stages for a cusp of Experiment 1, clearances to be kept to 0.01 mm."""
    scene = parse_scene({"mesh": {"size": 2.0}, "solver": {"inside_tolerance": 0.02}})
    given = ValveInput.from_scene(scene)
    mesh = nested_meshes(given.geometry.cusps[0].template, 2.0, 0, False)[-1]
    setup = CuspSetup(scene, given.geometry, given.wedges, 0, mesh)
    return PenaltyRaising(setup, [], lambda _index, _record: None, None, 0)


def test_first_raise() -> None:
    """Truth: a miss that goes with 1/stiffness is gone after a factor of miss/allowed; 30 % more
    than that, but no more than the largest factor."""
    assert raising_factor((2.0, 0.3), 0.1, None, 10.0) == pytest.approx(1.3 * 3.0)
    assert raising_factor((2.0, 30.0), 0.1, None, 10.0) == 10.0


@pytest.mark.parametrize("power", [1.0, 0.5, 0.2])
def test_what_helped_less_is_raised_more(power: float) -> None:
    """Truth: when misses go with stiffness^-power, the next raise reaches what is allowed with 30 %
    to spare in stiffness."""

    def missed(stiffness: float) -> float:
        return float(5.0 * stiffness**-power)

    allowed, before, now = missed(1000.0), 10.0, 100.0
    factor = raising_factor((now, missed(now)), allowed, (before, missed(before)), np.inf)
    assert factor * now == pytest.approx(1.3 * 1000.0)


@pytest.mark.parametrize("after", [0.3, 0.299999, 0.4])
def test_a_raise_that_did_not_help(after: float) -> None:
    """Truth: then by as much as is allowed."""
    assert raising_factor((20.0, after), 0.1, (10.0, 0.3), 7.0) == 7.0


def test_large_triangles_are_moved_off_a_bend() -> None:
    """Truth: where the chord of an inner edge cuts more than half of its clearance into a ball on
    which its ends keep theirs, both ends are told by how much; a chord of a larger ball is not."""
    stages = raising()
    setup, mesh = stages.setup, stages.setup.mesh
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
        bulging = stages._bulging(points)
        assert bulging[edge] == pytest.approx(np.full(2, cut * told), abs=1e-9)
        assert np.count_nonzero(bulging) == 2 * told


def test_little_clearance_weighs_more() -> None:
    """Truth: a node may miss its clearance by 0.01 mm, or by half of it where that is less."""
    stages = raising()
    setup = stages.setup
    node = int(np.setdiff1d(np.arange(len(setup.mesh.points)), setup.mesh.suture_line)[-1])
    points = np.full((len(setup.mesh.points), 3), 50.0)
    points[node] = [2.0, 0.0, 0.0]
    for clearance, missed, expected in ((0.25, 0.004, 0.004), (0.008, 0.004, 0.01)):
        setup.wedge.clearance = np.full(len(points), clearance)
        radius = 2.0 - clearance + missed
        setup.wedge.field = OutsideBall(np.zeros(3), radius)  # type: ignore[assignment]
        assert stages.shortfalls(points)[1] == pytest.approx(expected, rel=1e-9)
