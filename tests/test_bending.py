"""Bending: patch tests, a cantilever, Taylor tests and invariances (D = E H^3/12 = 1 mN mm)."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla

from avneo_fem.equilibrium.directors import renew_directors
from avneo_fem.equilibrium.shell_model import ShellModel
from avneo_fem.meshing.cusp_mesh import CuspMesh
from shell_cases import (
    BENDING_ALONE,
    Floats,
    disc,
    edge_match,
    flat,
    renumbered,
    rotation,
    rough,
    shell,
    state_at,
    strip,
    taylor_orders,
    unit_direction,
)

MATERIALS = ["neo_hookean", "st_venant_kirchhoff"]


def curved(model: ShellModel, form: Floats) -> Floats:
    """State on z = X.B X/2 with the exact normals as directors."""
    points, middle = model.mesh.points, model.mesh.points[model.mesh.edges].mean(axis=1)
    state = state_at(model, np.c_[points, 0.5 * np.einsum("ni,ij,nj->n", points, form, points)])
    normals = np.c_[-middle @ form, np.ones(len(middle))]
    model.set_directors(normals / np.linalg.norm(normals, axis=1, keepdims=True))
    return state


@pytest.mark.parametrize("material", MATERIALS)
@pytest.mark.parametrize("seed", [1, 2])
def test_taylor(material: str, seed: int) -> None:
    """Truth: residual and tangent are first and second derivative in positions and angles."""
    model = shell(disc(2), material=material, **BENDING_ALONE)
    state = rough(model, seed)
    way = unit_direction(model, seed)
    slope = model.residual(state) @ way
    assert taylor_orders(model.energy, slope, state, way) == pytest.approx(2, abs=0.05)
    change = model.tangent(state) @ way
    assert taylor_orders(model.residual, change, state, way) == pytest.approx(2, abs=0.05)


def test_quadratic_and_convex_in_the_angles() -> None:
    """Truth: at fixed positions the energy is a quadratic in the angles with a positive form."""
    model = shell(disc(2), **BENDING_ALONE)
    state = rough(model, 3)
    way = np.zeros(model.size)
    way[model.angle_dofs] = np.random.default_rng(0).normal(size=len(model.angle_dofs))
    stiffness = model.tangent(state)
    predicted = model.energy(state) + model.residual(state) @ way + way @ stiffness @ way / 2
    assert model.energy(state + way) == pytest.approx(predicted, rel=1e-9)
    block = stiffness[model.angle_dofs][:, model.angle_dofs].toarray()
    assert np.linalg.eigvalsh(block).min() > 1e-3


@pytest.mark.parametrize("form", [[[1, 0], [0, 0]], [[1, 0], [0, 1]], [[0, 1], [1, 0]]])
@pytest.mark.parametrize("mesh", [disc(3), strip(5, 3, 2.0, 1.0)], ids=["disc", "strip"])
def test_constant_curvature_is_exact(mesh: CuspMesh, form: list) -> None:
    """Truth (patch test): a shallow z = X.B X/2 has the energy area * B:B/2 on any mesh, and
    no residual on free angles and inner nodes, as constant moments are in equilibrium."""
    model = shell(mesh, **BENDING_ALONE)
    small = 1e-3
    b = small * np.array(form, dtype=float)
    state = curved(model, b)
    assert model.energy(state) == pytest.approx(mesh.area / 2 * np.sum(b * b), rel=1e-5)
    residual = model.residual(state)
    inner_edge = mesh.edge_cells[:, 1] >= 0
    inner_node = np.ones(len(mesh.points), dtype=bool)
    inner_node[np.r_[mesh.suture_line, mesh.free_edge]] = False
    assert inner_node.any()
    # the boundary holds moments and corner forces of order ``small``, the inside none; forces in
    # the plane come with the rotations and are of second order
    assert np.abs(residual).max() > 0.05 * small
    assert np.abs(residual[model.angle_dofs[inner_edge]]).max() < 1e-5 * small
    forces = np.abs(residual[model.position_dofs[inner_node]])
    assert forces[:, 2].max() < 1e-5 * small
    assert forces.max() < small**2


def test_cylinder() -> None:
    """Truth: a sheet rolled on radius R, oblique to its mesh, has the energy D/2 * area / R^2;
    the error falls by 4 when the mesh size is halved."""
    radius, turn, errors = 1.5, 0.4, []
    c, s = np.cos(turn), np.sin(turn)
    for number in (4, 8, 16):
        mesh = strip(number, number, 2.0, 2.0)
        model = shell(mesh, **BENDING_ALONE)
        along, beside = mesh.points @ [c, s], mesh.points @ [-s, c]
        angle = along / radius
        state = state_at(model, np.c_[radius * np.sin(angle), beside, radius * (1 - np.cos(angle))])
        angle = mesh.points[mesh.edges].mean(axis=1) @ [c, s] / radius
        model.set_directors(np.c_[-np.sin(angle), 0 * angle, np.cos(angle)])
        errors.append(abs(model.energy(state) / (mesh.area / 2 / radius**2) - 1))
    assert errors[-1] < 5e-4
    assert np.log2(errors[0] / errors[-1]) / 2 > 1.6


def deflection(columns: int, rows: int) -> float:
    """Tip deflection of a clamped strip 10 x 1 under a transverse end force of 1e-3 mN."""
    mesh = strip(columns, rows, 10.0, 1.0)
    model = shell(mesh, pressure=0.0, free_edge_stiffness=0.0)
    state = state_at(model, flat(mesh))
    clamped = np.isclose(mesh.points[:, 0], 0.0)
    held = np.zeros(model.size, dtype=bool)
    held[model.position_dofs[clamped]] = True
    held[model.angle_dofs[clamped[mesh.edges].all(axis=1)]] = True
    tip = np.flatnonzero(np.isclose(mesh.points[:, 0], 10.0))
    weight = np.gradient(mesh.points[tip, 1])
    weight[[0, -1]] /= 2
    load = np.zeros(model.size)
    load[model.position_dofs[tip, 2]] = 1e-3 * weight / weight.sum()
    matrix = model.tangent(state)[~held][:, ~held].tocsc()
    answer = np.zeros(model.size)
    answer[~held] = spla.spsolve(matrix, load[~held])
    return float(answer[model.position_dofs[tip, 2]].mean())


def test_cantilever() -> None:
    """Truth: beam theory P L^3 / (3 D b) (nu = 0), reached from coarse to fine."""
    exact = 1e-3 * 10.0**3 / (3 * 1000 * 0.5**3 / 12)
    errors = [abs(deflection(n, max(1, n // 8)) / exact - 1) for n in (4, 8, 16, 32)]
    assert errors[-1] < 0.005
    assert errors[0] < 0.1
    assert np.all(np.diff(errors) < 0)
    assert np.log2(errors[0] / errors[-1]) / 3 > 1.5


@pytest.mark.parametrize("material", MATERIALS)
def test_rigid_motion_of_the_template(material: str) -> None:
    """Truth: a large rigid motion of the flat template leaves energy and residual at zero."""
    mesh = disc(3)
    model = shell(mesh, material=material, pressure=0.0, free_edge_stiffness=0.0)
    for seed in range(5):
        q = rotation(seed)
        state = state_at(model, flat(mesh) @ q.T + [5.0, -2.0, 1.0])
        np.testing.assert_allclose(model.directors, np.tile(q[:, 2], (len(mesh.edges), 1)))
        assert abs(model.energy(state)) < 1e-9
        assert np.abs(model.residual(state)).max() < 1e-8


def test_frame_indifference() -> None:
    """Truth: positions and directors of a bent state turned together: same energy, forces
    turned with them, same moments."""
    model = shell(disc(3), **BENDING_ALONE)
    state = rough(model, 4)
    energy, residual, directors = model.energy(state), model.residual(state), model.directors
    places, angles = model.position_dofs, model.angle_dofs
    assert energy > 0.1
    for seed in range(3):
        q = rotation(seed + 20)
        moved = state.copy()
        moved[places] = state[places] @ q.T + 2.0
        model.set_directors(directors @ q.T)
        assert model.energy(moved) == pytest.approx(energy, rel=1e-10)
        after = model.residual(moved)
        np.testing.assert_allclose(after[places], residual[places] @ q.T, atol=1e-8)
        np.testing.assert_allclose(after[angles], residual[angles], atol=1e-8)


def test_renewing_directors_changes_nothing() -> None:
    """Truth: renewed directors describe the same surface: same energy and moments; the same
    forces, too, once the angles are in equilibrium (before, a force at fixed angle depends on
    the director that the angle is counted from)."""
    model = shell(disc(3), **BENDING_ALONE)
    state, angles = rough(model, 5), model.angle_dofs
    aside = model.directors + 0.3 * np.random.default_rng(2).normal(size=model.directors.shape)
    model.set_directors(aside / np.linalg.norm(aside, axis=1, keepdims=True))
    energy, moments = model.energy(state), model.residual(state)[angles]
    renewed = renew_directors(model, state)
    assert np.abs(renewed[angles] - state[angles]).max() > 0.1
    assert model.energy(renewed) == pytest.approx(energy, rel=1e-10)
    np.testing.assert_allclose(model.residual(renewed)[angles], moments, atol=1e-8)
    block = model.tangent(renewed)[angles][:, angles].tocsc()
    model.set_directors(aside / np.linalg.norm(aside, axis=1, keepdims=True))
    settled = state.copy()
    settled[angles] -= spla.spsolve(block, moments)
    forces = model.residual(settled)
    again = model.residual(renew_directors(model, settled))
    assert np.abs(forces).max() > 0.01
    np.testing.assert_allclose(again, forces, atol=1e-8)


@pytest.mark.parametrize("seed", [0, 1])
def test_numbering_does_not_matter(seed: int) -> None:
    """Truth: renumbered nodes turn edges round; with their angles' signs the energy stays."""
    mesh = disc(3)
    number = np.random.default_rng(seed).permutation(len(mesh.points))
    other = renumbered(mesh, number)
    model, again = shell(mesh, **BENDING_ALONE), shell(other, **BENDING_ALONE)
    state = rough(model, 6)
    positions = np.empty_like(state[model.position_dofs])
    positions[number] = state[model.position_dofs]
    moved = state_at(again, positions)
    row = edge_match(mesh, other)
    sense = np.where(np.diff(number[mesh.edges], axis=1)[:, 0] > 0, 1.0, -1.0)
    assert set(sense) == {-1.0, 1.0}
    moved[again.angle_dofs[row]] = sense * state[model.angle_dofs]
    assert again.energy(moved) == pytest.approx(model.energy(state), rel=1e-10)
    np.testing.assert_allclose(
        again.residual(moved)[again.position_dofs[number]],
        model.residual(state)[model.position_dofs],
        atol=1e-8,
    )


def test_mirror_image() -> None:
    """Truth: a reflection turns angles and the side the normals look to, not the energy."""
    model = shell(disc(3), **BENDING_ALONE)
    state = rough(model, 7)
    energy, residual = model.energy(state), model.residual(state)
    normal = rotation(1)[0]
    mirror = np.eye(3) - 2 * np.outer(normal, normal)
    image = -state
    image[model.position_dofs] = state[model.position_dofs] @ mirror
    model.set_directors(-model.directors @ mirror)
    assert model.energy(image) == pytest.approx(energy, rel=1e-10)
    forces = model.residual(image)[model.position_dofs]
    np.testing.assert_allclose(forces, residual[model.position_dofs] @ mirror, atol=1e-8)
