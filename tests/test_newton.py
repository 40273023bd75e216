"""Newton iteration on inflated discs and on a fold pressed together."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from avneo_fem.constraints.proximal import ProximalTerm
from avneo_fem.constraints.self_contact import SelfContact
from avneo_fem.equilibrium.cusp_system import CuspSystem
from avneo_fem.equilibrium.newton import NewtonSettings, NewtonSolver, Verdict
from shell_cases import disc, flat, hairpin, shell, state_at, strip

Case = tuple[CuspSystem, np.ndarray]


def inflated(bending: bool = True, free_edge: bool = False) -> Case:
    """Disc under 8 kPa held (and clamped) at its rim, or at its suture line only."""
    mesh = disc(5)
    support = 80.0 if free_edge else 0.0
    model = shell(mesh, bending=bending, thickness=0.1, free_edge_stiffness=support)
    system = CuspSystem(model, None)
    rim = mesh.suture_line if free_edge else np.r_[mesh.suture_line, mesh.free_edge]
    system.fix(model.position_dofs[rim])
    if bending and not free_edge:
        system.fix(model.angle_dofs[mesh.edge_cells[:, 1] < 0])
    return system, state_at(model, flat(mesh))


CASES = [(True, False), (False, False), (True, True)]


@pytest.mark.parametrize(("bending", "free_edge"), CASES)
def test_converges_to_an_equilibrium_that_holds_the_load(bending: bool, free_edge: bool) -> None:
    """Truth: the undamped residual, assembled afresh, is below the tolerance; the disc bulges
    against its normal; at a held rim the reactions balance P times its area vector."""
    system, start = inflated(bending, free_edge)
    state, verdict = NewtonSolver(system, NewtonSettings()).solve(start, 1e-9)
    assert verdict.converged
    assert verdict.reason.startswith("converged")
    assert verdict.residual == pytest.approx(system.relative_residual(state))
    assert verdict.residual <= 1e-9
    model = system.model
    z = state[model.position_dofs[:, 2]]
    assert z.min() < -0.05
    if not free_edge:
        assert z.max() < 1e-12
        reactions = system.residual(state)[model.position_dofs].sum(axis=0)
        np.testing.assert_allclose(reactions, [0, 0, 8.0 * model.mesh.area], atol=1e-6)


@pytest.mark.parametrize(("bending", "free_edge"), CASES)
def test_quadratic_convergence(bending: bool, free_edge: bool) -> None:
    """Truth: near the solution r_(k+1) <= C r_k^2 (C = 20, residuals relative to the load),
    with the free edge's unsymmetric pressure stiffness too."""
    system, start = inflated(bending, free_edge)
    newton = NewtonSolver(system, NewtonSettings())
    state, _ = newton.solve(start, 1e-9)
    state[system.free] += 1e-3 * np.random.default_rng(1).uniform(-1, 1, len(system.free))
    residuals = [system.relative_residual(state)]
    for _ in range(5):
        state, verdict = newton.solve(state, 1e-12, maximum_iterations=1)
        residuals.append(verdict.residual)
    assert residuals[-1] < 1e-12
    near = [(a, b) for a, b in pairwise(residuals) if 1e-9 < a < 1e-2]
    assert len(near) >= 2
    for before, after in near:
        assert after < max(20 * before**2, 1e-12)


def test_symmetric_tangent_alone_is_slower() -> None:
    """Truth: with a free edge the pressure stiffness is not symmetric; without its exact tangent
    the tail is linear, so the switch below ``exact_below`` earns its place."""
    counts = []
    for exact_below in (1e-3, 0.0):
        system, start = inflated(free_edge=True)
        newton = NewtonSolver(system, NewtonSettings(exact_below=exact_below))
        state, _ = newton.solve(start, 1e-4)
        _, verdict = newton.solve(state, 1e-11)
        assert verdict.converged
        counts.append(verdict.iterations)
        assert (newton.general.count > 0) == (exact_below > 0)
    assert counts[0] < counts[1]


def test_iteration_limit_is_not_convergence() -> None:
    """Truth: after one iteration of many the verdict says so and tells the true residual; the
    state is the first iterate, better than the start."""
    system, start = inflated()
    newton = NewtonSolver(system, NewtonSettings())
    state, verdict = newton.solve(start, 1e-9, maximum_iterations=1)
    assert (verdict.converged, verdict.iterations) == (False, 1)
    assert verdict.reason == "iteration limit reached"
    assert verdict.residual == pytest.approx(system.relative_residual(state))
    assert verdict.residual > 1e-9
    assert system.merit_change(state, start, system.energy(start)) < 0
    limited = NewtonSolver(system, NewtonSettings(maximum_iterations=2))
    assert limited.solve(start, 1e-9)[1].iterations == 2


def test_no_descent_direction_is_a_linear_failure() -> None:
    """Truth: a flat membrane has no stiffness across; with no shift allowed there is no Newton
    direction, which is reported, and the state comes back as it was."""
    system, start = inflated(bending=False)
    newton = NewtonSolver(system, NewtonSettings(largest_shift=0.0))
    state, verdict = newton.solve(start, 1e-9)
    assert (verdict.converged, verdict.reason) == (False, "linear solver failed")
    np.testing.assert_array_equal(state, start)


def test_not_a_number_is_reported() -> None:
    """Truth: a state in which a triangle has collapsed has no residual; never converged."""
    system, start = inflated()
    start[system.model.position_dofs] *= 0.0
    _, verdict = NewtonSolver(system, NewtonSettings()).solve(start, 1e-9)
    assert (verdict.converged, verdict.reason) == (False, "residual is not a number")


def test_solved_before_it_starts() -> None:
    """Truth: an equilibrium is handed back as it is after no iteration."""
    system, start = inflated()
    newton = NewtonSolver(system, NewtonSettings())
    state, _ = newton.solve(start, 1e-9)
    done = newton.iterations
    again, verdict = newton.solve(state, 1e-8)
    assert (verdict.converged, verdict.iterations, newton.iterations) == (True, 0, done)
    np.testing.assert_array_equal(again, state)


@pytest.mark.parametrize(("bending", "free_edge"), CASES)
def test_fixed_entries_are_untouched(bending: bool, free_edge: bool) -> None:
    """Truth: held entries are bitwise those of the start, the caller's array is not written to,
    and everything free has moved."""
    system, start = inflated(bending, free_edge)
    kept = start.copy()
    state, _ = NewtonSolver(system, NewtonSettings()).solve(start, 1e-6)
    np.testing.assert_array_equal(start, kept)
    np.testing.assert_array_equal(state[system.fixed], kept[system.fixed])
    moved = np.abs(system.positions(state) - system.positions(kept)).max(axis=1) > 1e-3
    held = system.fixed[system.model.position_dofs[:, 0]]
    np.testing.assert_array_equal(moved, ~held)


def test_no_node_moves_too_far() -> None:
    """Truth: one iteration moves no node by more than ``largest_move``, here much less than the
    full step would."""
    moves = []
    for largest in (0.01, 1.0):
        system, start = inflated()
        newton = NewtonSolver(system, NewtonSettings(largest_move=largest))
        state, _ = newton.solve(start, 1e-9, maximum_iterations=1)
        way = system.positions(state) - system.positions(start)
        moves.append(np.linalg.norm(way, axis=1).max())
    assert moves[0] == pytest.approx(0.01)
    assert 0.02 < moves[1] <= 1.0 + 1e-12


def test_damping_is_part_of_the_problem() -> None:
    """Truth: with a proximal term its force balances the undamped residual at the solution, and
    the verdict's residual is that of the damped problem."""
    system, start = inflated()
    model = system.model
    damping = ProximalTerm(system.positions(start), model.mesh.node_areas, 50.0)
    state, verdict = NewtonSolver(system, NewtonSettings()).solve(start, 1e-10, [damping])
    assert verdict.converged
    assert system.relative_residual(state) > 0.01
    pull = np.zeros(model.size)
    pull[model.position_dofs] = damping.gradient(system.positions(state))
    balance = (system.residual(state) + pull)[system.free]
    assert np.linalg.norm(balance) / model.load_scale() == pytest.approx(
        verdict.residual, abs=1e-14
    )


# -- contact -----------------------------------------------------------------------------------
def pressed_fold(with_contact: bool) -> tuple[list[np.ndarray], SelfContact, Verdict]:
    """Positions at every evaluation while the upper layer of a fold is pulled to 0.6 mm below
    the lower one, which is held."""
    mesh = strip(16, 3, 4.0, 0.8)
    model = shell(mesh, thickness=0.1, pressure=1.0, free_edge_stiffness=0.0)
    model.pressure = 0.0
    state = state_at(model, hairpin(mesh, 0.4))
    contact = SelfContact(flat(mesh), mesh.triangles, distance=0.05, stiffness=100.0)
    system = CuspSystem(model, contact if with_contact else None)
    system.fix(model.position_dofs[mesh.points[:, 0] < 1.4])
    goal = system.positions(state) - [0.0, 0.0, 1.0]
    upper = mesh.points[:, 0] > 2.6
    system.terms.append(ProximalTerm(goal, mesh.node_areas * upper, 200.0))
    visited: list[np.ndarray] = []
    energy, residual = model.energy, model.residual

    def seen_energy(u: np.ndarray) -> float:
        visited.append(system.positions(u).copy())
        return energy(u)

    def seen_residual(u: np.ndarray) -> np.ndarray:
        visited.append(system.positions(u).copy())
        return residual(u)

    model.energy, model.residual = seen_energy, seen_residual  # type: ignore[method-assign]
    _, verdict = NewtonSolver(system, NewtonSettings()).solve(state, 1e-6)
    return visited, contact, verdict


def test_pressed_fold_never_crosses() -> None:
    """Truth: with self-contact no state at which anything is evaluated, trial steps of the line
    search included, has crossing triangles; the solve converges with the layers in contact."""
    visited, contact, verdict = pressed_fold(with_contact=True)
    assert verdict.converged
    assert len(visited) > 50
    assert not any(contact.intersects(points) for points in visited)
    assert 0 < contact.closest(visited[-1]) < contact.distance


def test_the_same_fold_crosses_without_contact() -> None:
    """Truth: the pull does drive the layers through each other when nothing stops them, so the
    test above can fail."""
    visited, contact, _ = pressed_fold(with_contact=False)
    assert contact.intersects(visited[-1])
