"""The harmonic predictor against exact harmonic functions and the principles they obey."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.harmonic import harmonic_extension
from avneo_fem.meshing.triangulate import triangulate_template
from shell_cases import disc, renumbered, strip
from valve_cases import build


def cusp(size: float) -> CuspMesh:
    """Experiment 1's template."""
    return triangulate_template(build({}).cusps[0].template, size)


def dirichlet(mesh: CuspMesh, values: np.ndarray) -> float:
    """1/2 integral |grad u|^2, from the gradient in each triangle."""
    corners = mesh.points[mesh.triangles]
    sides = np.stack([corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
    of = values[mesh.triangles]
    slopes = np.linalg.solve(sides, np.stack([of[:, 1] - of[:, 0], of[:, 2] - of[:, 0]], axis=1))
    return float(mesh.cell_areas @ (slopes**2).sum(axis=(1, 2)) / 2)


def test_linear_functions_along_the_free_edge() -> None:
    """Truth: a + b x is harmonic and flat across the strip's free edge y = 1: reproduced."""
    mesh = strip(9, 4, 3.0, 1.0)
    x = mesh.points[:, 0]
    exact = np.c_[2.0 + 0.0 * x, x, 1.0 - 3.0 * x]
    np.testing.assert_allclose(
        harmonic_extension(mesh, mesh.suture_line, exact[mesh.suture_line]), exact, atol=1e-12
    )


def test_converges_to_a_harmonic_function() -> None:
    """Truth: cos(x) cosh(1 - y) is harmonic with no slope at the free edge y = 1; linear triangles
    are second order in the mesh size."""
    errors = []
    for fine in (1, 2, 4, 8):
        mesh = strip(6 * fine, 3 * fine, 2.0, 1.0)
        x, y = mesh.points.T
        exact = (np.cos(x) * np.cosh(1 - y))[:, None]
        found = harmonic_extension(mesh, mesh.suture_line, exact[mesh.suture_line])
        errors.append(np.sqrt(mesh.node_areas @ (found - exact)[:, 0] ** 2))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert orders[-1] == pytest.approx(2, abs=0.25)
    assert errors[-1] < 1e-3


@pytest.mark.parametrize("size", [3.0, 2.0, 1.0, 0.7])
def test_maximum_principle_on_templates(size: float) -> None:
    """Truth: a harmonic function has its extremes at the given boundary, also of random values; so
    no node of the predictor moves further, in any direction, than some sutured node."""
    mesh = cusp(size)
    values = np.random.default_rng(7).normal(size=(len(mesh.suture_line), 5))
    found = harmonic_extension(mesh, mesh.suture_line, values)
    inside = np.setdiff1d(np.arange(len(mesh.points)), mesh.suture_line)
    assert (found[inside].max(axis=0) < values.max(axis=0)).all()
    assert (found[inside].min(axis=0) > values.min(axis=0)).all()


@pytest.mark.parametrize("mesh", [strip(7, 4, 2.0, 1.0), disc(5), cusp(2.0)])
def test_energy_is_least(mesh: CuspMesh) -> None:
    """Truth: of all functions with the same sutured values it has the least Dirichlet energy, which
    grows by just that of the difference (Pythagoras)."""
    random = np.random.default_rng(1)
    found = harmonic_extension(
        mesh, mesh.suture_line, random.normal(size=(len(mesh.suture_line), 2))
    )
    for _ in range(5):
        change = random.normal(size=found.shape)
        change[mesh.suture_line] = 0.0
        more = dirichlet(mesh, found + change) - dirichlet(mesh, found)
        assert more == pytest.approx(dirichlet(mesh, change), rel=1e-9)
        assert more > 0


def test_values_are_kept_and_the_map_is_linear() -> None:
    """Truth: exactly the given values at the suture; superposition; columns do not mix."""
    mesh = cusp(2.5)
    random = np.random.default_rng(2)
    a, b = random.normal(size=(2, len(mesh.suture_line), 3))
    one, two = (
        harmonic_extension(mesh, mesh.suture_line, a),
        harmonic_extension(mesh, mesh.suture_line, b),
    )
    np.testing.assert_array_equal(one[mesh.suture_line], a)
    np.testing.assert_allclose(
        harmonic_extension(mesh, mesh.suture_line, a - 2 * b), one - 2 * two, atol=1e-12
    )
    np.testing.assert_allclose(
        harmonic_extension(mesh, mesh.suture_line, a[:, 1:2]), one[:, 1:2], atol=1e-12
    )


def test_numbering_does_not_matter() -> None:
    """Truth: the same values at the same places when the nodes are numbered otherwise."""
    mesh = strip(6, 4, 2.0, 1.0)
    number = np.random.default_rng(3).permutation(len(mesh.points))
    values = np.random.default_rng(4).normal(size=(len(mesh.suture_line), 3))
    other = renumbered(mesh, number)
    found = harmonic_extension(other, other.suture_line, values)
    np.testing.assert_allclose(
        found[number], harmonic_extension(mesh, mesh.suture_line, values), atol=1e-12
    )
