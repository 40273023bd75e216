"""Pseudo-transient continuation: it settles, and says why when it does not."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.newton import NewtonSettings, NewtonSolver, Verdict
from avneo_fem.equilibrium.relaxation import Relaxation, RelaxationSettings
from shell_cases import Floats, flat, shell, state_at, strip

#: E H / L^2 of the strip below [kPa/mm]
UNIT = 1000.0 * 0.5 / 4.0
TOLERANCE = 1e-9


def membrane(contact: bool = False) -> tuple[CuspSystem, Floats, Relaxation]:
    """A strip 4 x 2 mm held at three sides, its state slightly bulged, and the relaxation.

    It inflates into a tension field: one equilibrium.
    """
    mesh = strip(8, 4, 4.0, 2.0)
    model = shell(mesh, pressure=20.0, free_edge_stiffness=0.0)
    barrier = SelfContact(flat(mesh), mesh.triangles, 0.05, 1.0) if contact else None
    system = CuspSystem(model, barrier)
    points = flat(mesh)
    points[:, 2] -= 0.05 * mesh.distance_to_suture
    system.fix(model.position_dofs[mesh.suture_line])
    newton = NewtonSolver(system, NewtonSettings(first_shift=0.03 * UNIT))
    return system, state_at(model, points), Relaxation(system, newton, RelaxationSettings(UNIT))


def free_norm(system: CuspSystem, force: Floats) -> float:
    """Norm of the free entries over the load, from the raw force; moments at their arm."""
    force = force.copy()
    force[system.model.angle_dofs] /= 0.1 * np.sqrt(system.model.mesh.area)
    return float(np.linalg.norm(force[~system.fixed]) / system.model.load_scale())


@pytest.mark.parametrize("contact", [False, True])
def test_settles(contact: bool) -> None:
    """Truth: the undamped residual, computed anew, is below the tolerance; what was held did not
    move; the verdict's figures are those of the state."""
    system, start, relaxation = membrane(contact)
    state, verdict = relaxation.settle(start, TOLERANCE, 0.6, 200)
    assert verdict.converged
    assert verdict.reason == "converged: residual below tolerance"
    assert free_norm(system, system.residual(state)) <= TOLERANCE
    assert verdict.residual == pytest.approx(free_norm(system, system.residual(state)))
    assert free_norm(system, system.residual(start)) > 0.1
    assert 2 < verdict.iterations <= 200
    line = system.model.mesh.suture_line
    np.testing.assert_array_equal(system.positions(state)[line], system.positions(start)[line])
    sag = system.positions(start)[:, 2].min() - system.positions(state)[:, 2].min()
    assert sag > 0.1  # it moved at all
    if system.contact is not None:
        assert system.contact.project


def test_the_way_does_not_matter() -> None:
    """Truth: an inflated membrane has one equilibrium: the same from other starts, dampings and
    tolerances on the way, to what the residual allows."""
    system, start, relaxation = membrane()
    first, _ = relaxation.settle(start, 1e-11, 0.6, 300)
    for damping in (0.01, 10.0):
        other, verdict = relaxation.settle(start, 1e-11, damping, 300)
        assert verdict.converged
        np.testing.assert_allclose(system.positions(other), system.positions(first), atol=1e-8)
    again, verdict = relaxation.settle(first, 1e-11, 0.6, 300)
    assert (verdict.converged, verdict.iterations) == (True, 0)
    np.testing.assert_array_equal(system.positions(again), system.positions(first))


@pytest.mark.parametrize("budget", [1, 3, 7])
def test_budget(budget: int) -> None:
    """Truth: no more Newton iterations than allowed; the reason names the limit, and the residual
    is the undamped one of the state that is returned, which is not worse than the first."""
    system, start, relaxation = membrane()
    used = relaxation.newton.iterations
    state, verdict = relaxation.settle(start, 1e-14, 0.6, budget)
    assert not verdict.converged
    assert verdict.reason == f"iteration limit of {budget} reached"
    assert verdict.iterations == relaxation.newton.iterations - used == budget
    residual = free_norm(system, system.residual(state))
    assert verdict.residual == pytest.approx(residual)
    assert residual < free_norm(system, system.residual(start))


class Stuck:
    """A Newton solver that never gets anywhere; notes the damping it was given."""

    def __init__(self) -> None:
        self.dampings: list[float] = []

    def solve(
        self, state: Floats, _target: float, extra: Any = (), _limit: int | None = None
    ) -> tuple[Floats, Verdict]:
        self.dampings.append(extra[0].damping if extra else 0.0)
        return state, Verdict(False, "line search found no decrease", 0, 1.0, 0.0)


def test_stalled() -> None:
    """Truth: without any decrease it damps more and more, up to the largest damping, then gives
    up after ``largest_stalls`` and says so; the state is untouched."""
    system, start, relaxation = membrane()
    stuck = Stuck()
    settings = replace(relaxation.settings, largest_stalls=9)
    stalled = Relaxation(system, stuck, settings)  # type: ignore[arg-type]
    state, verdict = stalled.settle(start, TOLERANCE, 0.6, 100)
    assert not verdict.converged
    assert verdict.reason == "no step decreases the energy, whatever the damping"
    np.testing.assert_array_equal(system.positions(state), system.positions(start))
    expected = np.minimum(0.6 * 2.0 ** np.arange(10), settings.largest) * UNIT
    np.testing.assert_allclose(stuck.dampings, expected)


def test_not_a_number() -> None:
    """Truth: a state that is none is not iterated on."""
    system, start, relaxation = membrane()
    broken = start.copy()
    broken[system.free[:5]] = np.nan
    _, verdict = relaxation.settle(broken, TOLERANCE, 0.6, 100)
    assert (verdict.converged, verdict.reason) == (False, "residual is not a number")
    assert verdict.iterations == 0


def test_damped_step() -> None:
    """Truth: it balances forces with mu S_n (x - x_0) to a tenth of the first residual, x_0 the
    start; ten times the damping, less way, in the limit a tenth of it."""
    system, start, relaxation = membrane()
    first = free_norm(system, system.residual(start))
    ways = []
    for damping in (0.1, 1.0, 10.0, 100.0, 1000.0, 10000.0):
        state, verdict = relaxation.damped(start, damping, 30)
        assert verdict.converged
        force = system.residual(state)
        moves = system.positions(state) - system.positions(start)
        areas = system.model.mesh.node_areas[:, None]
        force[system.model.position_dofs] += damping * UNIT * areas * moves
        assert free_norm(system, force) <= 0.1 * first
        ways.append(np.linalg.norm(moves))
    assert (np.diff(ways) < 0).all()
    assert ways[-2] / ways[-1] == pytest.approx(10.0, rel=0.2)
