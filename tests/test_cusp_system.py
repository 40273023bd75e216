"""Elastic model plus constraint terms: sums, derivatives, reduction to free unknowns."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.constraints.proximal import ProximalTerm
from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.constraints.signed_distance_penalty import SignedDistancePenalty
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.shell_model import ShellModel
from shell_cases import (
    disc,
    flat,
    hairpin,
    rough,
    shell,
    state_at,
    strip,
    taylor_orders,
    unit_direction,
)

BENDING = [True, False]


class Ball:
    """Signed distance to the unit ball about the origin, positive inside."""

    def evaluate(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        r = np.linalg.norm(x, axis=1)
        normal = x / r[:, None]
        outer = normal[:, :, None] * normal[:, None, :]
        return 1 - r, -normal, -(np.eye(3) - outer) / r[:, None, None]


def terms(model: ShellModel, seed: int) -> tuple[SignedDistancePenalty, ProximalTerm]:
    areas = model.mesh.node_areas
    ball = SignedDistancePenalty(Ball(), areas, 50.0, 4.0, np.full(len(areas), 0.1))
    random = np.random.default_rng(seed)
    return ball, ProximalTerm(random.normal(size=(len(areas), 3)), areas, 30.0)


def system_with_terms(bending: bool) -> tuple[CuspSystem, ProximalTerm]:
    system = CuspSystem(shell(disc(2), bending=bending, free_edge_width=20.0), None)
    ball, damping = terms(system.model, 1)
    system.terms.append(ball)
    return system, damping


@pytest.mark.parametrize("bending", BENDING)
def test_sum_of_its_parts(bending: bool) -> None:
    """Truth: energy, residual and tangent are those of the model plus those of each term, the
    latter at the entries of the positions."""
    system, damping = system_with_terms(bending)
    model, ball = system.model, system.terms[0]
    state = rough(model, 1)
    x = state[model.position_dofs]
    energy = model.energy(state) + ball.energy(x) + damping.energy(x)
    assert system.energy(state, [damping]) == pytest.approx(energy)
    expected = model.residual(state)
    expected[model.position_dofs] += ball.gradient(x) + damping.gradient(x)
    np.testing.assert_allclose(system.residual(state, [damping]), expected)
    dense = model.tangent(state).toarray()
    places = model.position_dofs.ravel()
    dense[np.ix_(places, places)] += (ball.hessian(x) + damping.hessian(x)).toarray()
    np.testing.assert_allclose(system.tangent(state, [damping]).toarray(), dense, atol=1e-9)
    np.testing.assert_array_equal(system.positions(state), x)


@pytest.mark.parametrize("bending", BENDING)
def test_without_terms_it_is_the_model(bending: bool) -> None:
    """Truth: a system of no terms has the model's energy, residual and tangent."""
    model = shell(disc(2), bending=bending)
    system, state = CuspSystem(model, None), rough(model, 2)
    assert system.energy(state) == model.energy(state)
    np.testing.assert_array_equal(system.residual(state), model.residual(state))
    assert (system.tangent(state) != model.tangent(state)).nnz == 0


@pytest.mark.parametrize("bending", BENDING)
@pytest.mark.parametrize("seed", [1, 2])
def test_merit_is_consistent_with_the_residual(bending: bool, seed: int) -> None:
    """Truth: along a straight step the merit change, pressure included, has the residual as its
    derivative, at the base and further on; the residual has the tangent as its own."""
    system, damping = system_with_terms(bending)
    base, way = rough(system.model, seed), unit_direction(system.model, seed)
    energy = system.energy(base, [damping])

    def merit(state: np.ndarray) -> float:
        return system.merit_change(state, base, energy, [damping])

    assert merit(base) == 0.0
    for state in (base, base + 0.02 * way):
        slope = system.residual(state, [damping]) @ way
        assert taylor_orders(merit, slope, state, way) == pytest.approx(2, abs=0.05)
        change = system.tangent(state, [damping]) @ way
        orders = taylor_orders(lambda u: system.residual(u, [damping]), change, state, way)
        assert orders == pytest.approx(2, abs=0.05)


def test_merit_with_contact() -> None:
    """Truth: the same with an active barrier between the layers of a fold, whose Hessian is the
    true one while ``project`` is off."""
    mesh = strip(12, 2, 4.0, 0.7, jitter=0.0)
    model = shell(mesh)
    # off the aligned position, where the barrier is smooth only once
    aside = 0.02 * np.random.default_rng(1).uniform(-1, 1, (len(mesh.points), 3))
    state = state_at(model, hairpin(mesh, 0.1) + aside)
    contact = SelfContact(flat(mesh), mesh.triangles, distance=0.3, stiffness=10.0)
    contact.project = False
    system = CuspSystem(model, contact)
    assert contact.collisions(system.positions(state)) > 10
    assert np.abs(system.residual(state) - model.residual(state)).max() > 1e-3
    energy, way = system.energy(state), unit_direction(model, 1)
    assert energy > model.energy(state)

    def merit(u: np.ndarray) -> float:
        return system.merit_change(u, state, energy)

    orders = taylor_orders(merit, system.residual(state) @ way, state, way, 2e-5)
    assert orders == pytest.approx(2, abs=0.05)
    orders = taylor_orders(system.residual, system.tangent(state) @ way, state, way, 2e-5)
    assert orders == pytest.approx(2, abs=0.05)


def test_fixed_and_free() -> None:
    """Truth: what is fixed, in any shape and twice over, is not free; the rest is."""
    model = shell(disc(2))
    system = CuspSystem(model, None)
    np.testing.assert_array_equal(system.free, np.arange(model.size))
    rim = model.mesh.suture_line
    system.fix(model.position_dofs[rim])
    system.fix(model.position_dofs[rim[:3], 2])
    system.fix(model.angle_dofs[:2])
    assert len(system.free) == model.size - 3 * len(rim) - 2
    assert not np.isin(system.free, model.position_dofs[rim]).any()
    assert not np.isin(system.free, model.angle_dofs[:2]).any()


def test_relative_residual() -> None:
    """Truth: norm of the residual's free entries over the load; terms count."""
    system, _ = system_with_terms(True)
    state = rough(system.model, 3)
    system.fix(system.model.position_dofs[system.model.mesh.suture_line])
    force = system.residual(state)
    force[system.model.angle_dofs] /= 0.1 * np.sqrt(system.model.mesh.area)  # moments
    expected = np.linalg.norm(force[~system.fixed]) / system.model.load_scale()
    assert system.relative_residual(state) == pytest.approx(expected)
    system.terms.clear()
    assert system.relative_residual(state) != pytest.approx(expected)


@pytest.mark.parametrize("bending", BENDING)
def test_foreseen_is_the_sum_over_the_terms(bending: bool) -> None:
    """Truth: None while no term can tell; then the sum of what each foresees at the entries of the
    positions, nothing at the angles, and what switches one term after the other."""
    system, damping = system_with_terms(bending)
    model, random = system.model, np.random.default_rng(4)
    state, step = rough(model, 4), random.uniform(-1.0, 1.0, model.size)
    count = len(model.mesh.points)
    areas = model.mesh.node_areas
    one, other = (
        SignedDistancePenalty(Ball(), areas, 9.0 * width, width, np.full(count, 0.1))
        for width in (1.0, 0.5)
    )
    system.terms = [damping]
    assert system.foreseen(state, step) is None
    for chosen in ([one], [one, damping, other]):
        system.terms = chosen
        found = system.foreseen(state, step)
        x, moves = state[model.position_dofs], step[model.position_dofs]
        parts = [term.foreseen(x, moves) for term in chosen if term is not damping]
        np.testing.assert_array_equal(
            found.switched, np.concatenate([part.switched for part in parts])
        )
        gradient, hessian = np.zeros(model.size), np.zeros((model.size, model.size))
        gradient[model.position_dofs] = sum(part.gradient for part in parts)
        places = model.position_dofs.ravel()
        hessian[np.ix_(places, places)] = sum(part.hessian.toarray() for part in parts)
        assert gradient.any()
        np.testing.assert_array_equal(found.gradient, gradient)
        np.testing.assert_array_equal(found.hessian.toarray(), hessian)
