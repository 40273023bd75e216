"""Shell of degree 2 and 3: derivatives, patch tests, directors, and degree 1 against the fast
kernel (D = E H^3/12 = 1 mN mm)."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avneo_fem.equilibrium.directors import renew_directors, start_directors, turn_directors
from avneo_fem.equilibrium.high_order_shell import HighOrderShell, shell_model
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.meshing.cusp_mesh import CuspMesh
from shell_cases import (
    BENDING_ALONE,
    Floats,
    disc,
    merit,
    rotation,
    strip,
    taylor_orders,
    unit_direction,
)

DEGREES = [2, 3]


def shell(mesh: CuspMesh, degree: int, **parameters: Any) -> HighOrderShell:
    """Model of any degree by the general kernel, degree 1 too."""
    return HighOrderShell(mesh, ShellParameters(degree=degree, **parameters))


def state_at(model: ShellModel, positions: Floats) -> Floats:
    """State with these node positions and directors along the mean normals."""
    state = np.zeros(model.size)
    state[model.position_dofs] = positions
    return start_directors(model, state)


def wavy(model: ShellModel, seed: int = 0) -> Floats:
    """State far from flat: bent, stretched, nodes displaced at random, random angles."""
    random = np.random.default_rng(seed)
    x, y = model.node_points.T
    positions = np.c_[1.1 * x + 0.1 * y, 0.9 * y, 0.3 * np.sin(2 * x) * np.cos(1.5 * y)]
    size = np.sqrt(model.mesh.area / len(x))
    positions += 0.05 * size * random.uniform(-1, 1, positions.shape)
    state = state_at(model, positions @ rotation(seed).T)
    state[model.angle_dofs] += 0.1 * random.uniform(-1, 1, model.angle_dofs.shape)
    return state


@pytest.mark.parametrize("degree", DEGREES)
def test_taylor(degree: int) -> None:
    """Truth: residual = derivative of the merit (energy less pressure work on a straight step),
    tangent = derivative of the residual; membrane, bending, pressure and free edge together."""
    model = shell(disc(2), degree, young_modulus=10.0, thickness=0.5, free_edge_width=20.0)
    base = wavy(model)
    way = 0.3 * unit_direction(model, 1)
    slope = model.residual(base) @ way
    assert taylor_orders(merit(model, base), slope, base, way) == pytest.approx(2, abs=0.05)
    change = model.tangent(base) @ way
    assert taylor_orders(model.residual, change, base, way) == pytest.approx(2, abs=0.05)


def test_degree_one_is_the_fast_kernel() -> None:
    """Truth: with k = 1 and the same directors the general kernel gives the energy and the
    forces of ``mechanics.bending``, written independently as one-point cell integrals."""
    mesh = disc(3)
    general, fast = (
        shell(mesh, 1, **BENDING_ALONE),
        ShellModel(mesh, ShellParameters(**BENDING_ALONE)),
    )
    points = np.c_[mesh.points, 0.3 * np.sin(2 * mesh.points[:, 0])]
    # one director for the whole mesh, so that nodes and edges mean the same
    direction = np.array([0.1, -0.2, 1.0]) / np.linalg.norm([0.1, -0.2, 1.0])
    states = []
    for model, count in ((general, len(mesh.points)), (fast, len(mesh.edges))):
        state = np.zeros(model.size)
        state[model.position_dofs] = points
        model.set_directors(np.tile(direction, (count, 1)))
        states.append(state)
    edges = np.arange(len(mesh.edges))
    angle = np.random.default_rng(0).uniform(-0.3, 0.3, len(edges))
    states = [
        turn_directors(model, state, edges, angle)
        for model, state in zip((general, fast), states, strict=True)
    ]
    assert general.energy(states[0]) == pytest.approx(fast.energy(states[1]), rel=1e-12)
    forces = [
        model.residual(state)[model.position_dofs]
        for model, state in zip((general, fast), states, strict=True)
    ]
    np.testing.assert_allclose(forces[0], forces[1], atol=1e-11 * np.abs(forces[1]).max())


@pytest.mark.parametrize("degree", DEGREES)
@pytest.mark.parametrize("form", [[[1, 0], [0, 0]], [[1, 0], [0, 1]], [[0, 1], [1, 0]]])
def test_constant_curvature_is_exact(degree: int, form: list) -> None:
    """Truth (patch test): z = X.B X/2 has the energy area * B:B/2, and no force on inner nodes
    and angles, as constant moments are in equilibrium."""
    mesh = disc(3)
    model = shell(mesh, degree, **BENDING_ALONE)
    small = 1e-3
    b = small * np.array(form, dtype=float)
    points = model.node_points
    state = state_at(model, np.c_[points, 0.5 * np.einsum("ni,ij,nj->n", points, b, points)])
    normals = np.c_[-points @ b, np.ones(len(points))]
    model.set_directors(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    assert model.energy(state) == pytest.approx(mesh.area / 2 * np.sum(b * b), rel=1e-5)
    residual = model.residual(state)
    inner_edge = mesh.edge_cells[:, 1] >= 0
    assert np.abs(residual).max() > 0.02 * small
    assert np.abs(residual[model.angle_dofs[inner_edge]]).max() < 1e-5 * small
    radius = np.linalg.norm(points, axis=1)
    forces = np.abs(residual[model.position_dofs[radius < 0.6]])
    assert forces[:, 2].max() < 1e-5 * small


@pytest.mark.parametrize("degree", DEGREES)
def test_cylinder(degree: int) -> None:
    """Truth: a sheet rolled on radius R, oblique to its mesh, has the energy D/2 * area / R^2;
    its error falls with at least twice the degree's order."""
    radius, turn, errors = 1.5, 0.4, []
    c, s = np.cos(turn), np.sin(turn)
    numbers = (2, 4, 8)
    for number in numbers:
        mesh = strip(number, number, 2.0, 2.0)
        model = shell(mesh, degree, **BENDING_ALONE)
        along, beside = model.node_points @ [c, s], model.node_points @ [-s, c]
        angle = along / radius
        state = state_at(model, np.c_[radius * np.sin(angle), beside, radius * (1 - np.cos(angle))])
        model.set_directors(np.c_[-np.sin(angle), 0 * angle, np.cos(angle)])
        errors.append(abs(model.energy(state) / (mesh.area / 2 / radius**2) - 1))
    assert np.log2(errors[0] / errors[-1]) / 2 > degree + 0.5
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("degree", DEGREES)
def test_rigid_motion(degree: int) -> None:
    """Truth: a large rigid motion of the flat template costs nothing, whatever the directors
    were before."""
    mesh = disc(2)
    model = shell(mesh, degree, pressure=0.0, free_edge_stiffness=0.0)
    flat = np.c_[model.node_points, np.zeros(len(model.node_points))]
    for seed in range(3):
        q = rotation(seed)
        state = state_at(model, flat @ q.T + [5.0, -2.0, 1.0])
        np.testing.assert_allclose(model.directors, np.tile(q[:, 2], (len(flat), 1)), atol=1e-12)
        assert abs(model.energy(state)) < 1e-9
        assert np.abs(model.residual(state)).max() < 1e-7


@pytest.mark.parametrize("degree", [1, *DEGREES])
def test_renewing_directors_changes_nothing(degree: int) -> None:
    """Truth: renewed directors describe the same surface: same energy and the same moments on
    the edges; renewing twice is renewing once."""
    model = shell(disc(2), degree, **BENDING_ALONE)
    state = wavy(model, 4)
    state[model.position_dofs] += 0.1 * np.sin(3 * state[model.position_dofs][:, [1, 2, 0]])
    energy, moments = model.energy(state), model.residual(state)[model.angle_dofs]
    before = model.directors.copy()
    renewed = renew_directors(model, state)
    assert np.abs(model.directors - before).max() > 0.01
    assert model.energy(renewed) == pytest.approx(energy, rel=1e-10)
    after = model.residual(renewed)[model.angle_dofs]
    np.testing.assert_allclose(after, moments, atol=1e-9 * np.abs(moments).max())
    again = renew_directors(model, renewed)
    np.testing.assert_allclose(again, renewed, atol=1e-10)


@pytest.mark.parametrize("degree", [1, *DEGREES])
def test_turned_edge_of_a_flat_sheet(degree: int) -> None:
    """Truth: turning the director of one edge of a flat sheet costs energy that grows with the
    square of the angle; for degree 1 it is l^2 a^2/(2 |T|) in each triangle at the edge."""
    mesh = strip(1, 1, 1.0, 1.0)
    model = shell(mesh, degree, **BENDING_ALONE)
    flat = np.c_[model.node_points, np.zeros(len(model.node_points))]
    state = state_at(model, flat)
    energies = []
    for edge in range(len(mesh.edges)):
        turned = turn_directors(model, state, np.array([edge]), np.array([0.1]))
        energies.append(model.energy(turned))
        half = turn_directors(model, state, np.array([edge]), np.array([0.05]))
        assert model.energy(half) == pytest.approx(energies[-1] / 4, rel=1e-9)
    assert min(energies) > 1e-4
    if degree == 1:
        inner = mesh.edge_cells[:, 1] >= 0
        length = np.linalg.norm(np.diff(mesh.points[mesh.edges], axis=1)[:, 0], axis=1)
        np.testing.assert_allclose(energies, length**2 * 0.01 / (2 * 0.5) * (1 + inner), rtol=1e-9)


@pytest.mark.parametrize("degree", DEGREES)
def test_layout_of_the_state(degree: int) -> None:
    """Truth: positions and angles share out the state; vertices come first; the areas of the
    nodes add up to the template's."""
    mesh = disc(2)
    model = shell_model(mesh, ShellParameters(degree=degree))
    dofs = np.r_[model.position_dofs.ravel(), model.angle_dofs.ravel()]
    assert len(np.unique(dofs)) == len(dofs) == model.size
    np.testing.assert_allclose(model.node_points[: len(mesh.points)], mesh.points, atol=1e-12)
    assert model.node_areas.sum() == pytest.approx(mesh.area)
    assert model.node_areas.min() > 0
    edges, cells = len(mesh.edges), len(mesh.triangles)
    inner = (degree - 1) * (degree - 2) // 2
    assert len(model.node_points) == len(mesh.points) + (degree - 1) * edges + inner * cells


def test_membrane_alone_has_no_angles() -> None:
    """Truth: without bending there are positions only, and the energy is the membrane's: a
    uniform stretch of a linear template."""
    mesh = disc(2)
    model = shell(mesh, 2, bending=False, pressure=0.0, free_edge_stiffness=0.0)
    flat = np.c_[
        1.2 * model.node_points[:, 0], model.node_points[:, 1], 0 * model.node_points[:, 0]
    ]
    state = state_at(model, flat)
    assert model.size == 3 * len(model.node_points)
    expected = 0.5 * mesh.area * 1000 / 4 * (1.2**2 - 1 - np.log(1.2**2))
    assert model.energy(state) == pytest.approx(expected, rel=1e-12)
