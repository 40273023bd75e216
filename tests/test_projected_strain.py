"""The projection of a quadratic shell's strain, on one triangle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from avneo_fem import compat
from avneo_fem.compat import fem, ufl
from avneo_fem.mechanics.kinematics import right_cauchy_green
from avneo_fem.mechanics.projected_strain import projected_right_cauchy_green
from shell_cases import Floats

CORNERS = np.array([[0.1, 0.2], [1.3, -0.1], [0.4, 0.9]])


def one_triangle(seed: int) -> tuple[Any, Any, Any, Any]:
    """Mesh, C_R, C and the position of a random quadratic triangle."""
    domain = compat.create_mesh(CORNERS, np.array([[0, 1, 2]]))
    element = compat.vector_element(domain, "Lagrange", 3, 2)
    position = fem.Function(compat.function_space(domain, element))
    position.x.array[:] = np.random.default_rng(seed).uniform(-1, 1, len(position.x.array))
    space = compat.function_space(domain, compat.vector_element(domain, "DG", 3, 1))
    barycentric = fem.Function(space)
    barycentric.x.array.reshape(-1, 3)[compat.cell_dofs(space)] = np.eye(3)
    projected = projected_right_cauchy_green(domain, position, barycentric)
    return domain, projected, right_cauchy_green(ufl.grad(position)), position


def integral(integrand: Any, measure: Any) -> float:
    """Assembled value."""
    return float(fem.assemble_scalar(compat.compile_form(integrand * measure)))


@pytest.mark.parametrize("seed", [0, 1])
def test_what_defines_the_projection(seed: int) -> None:
    """Truth: C_R is linear; its mean is that of C; its tangential component on the edges is the
    L2 projection of that of C on linear functions."""
    domain, projected, full, _ = one_triangle(seed)
    dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 4})
    ds = ufl.Measure("ds", domain=domain, metadata={"quadrature_degree": 5})
    size = integral(ufl.inner(full, full), dx)
    assert size > 0.1
    second = ufl.grad(ufl.grad(projected))
    assert integral(ufl.inner(second, second), dx) < 1e-20 * size
    apart = projected - full
    assert integral(ufl.inner(apart, apart), dx) > 1e-3 * size
    for row, column in ((0, 0), (0, 1), (1, 1)):
        assert abs(integral(apart[row, column], dx)) < 1e-12 * size
    nu, (x, y) = ufl.FacetNormal(domain), ufl.SpatialCoordinate(domain)
    tangent = ufl.as_vector([-nu[1], nu[0]])
    along = ufl.dot(tangent, apart * tangent)
    for start, stop in ((0, 1), (1, 2), (2, 0)):
        middle = (CORNERS[start] + CORNERS[stop])[None] / 2
        tags = compat.edge_tags(domain, middle, 1)
        edge = ufl.Measure("ds", domain=domain, subdomain_data=tags)(
            1, metadata={"quadrature_degree": 5}
        )
        for weight in (1.0, x, y):
            assert abs(integral(weight * along, edge)) < 1e-12 * size
    across = ufl.dot(nu, apart * nu)
    assert abs(integral(across**2, ds)) > 1e-6 * size


def test_linear_positions_are_left_alone() -> None:
    """Truth: where the position is linear C is constant, and C_R = C."""
    domain, projected, full, position = one_triangle(0)
    frame = np.array([[1.1, 0.2], [0.3, 0.8], [-0.4, 0.6]])
    position.interpolate(lambda x: frame @ x[:2])
    dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 4})
    apart = projected - full
    assert integral(ufl.inner(apart, apart), dx) < 1e-24
    expected: Floats = frame.T @ frame
    area = integral(ufl.as_ufl(1.0), dx)
    assert integral(projected[0, 1], dx) == pytest.approx(expected[0, 1] * area, rel=1e-12)


def test_rolled_triangle_is_hardly_strained() -> None:
    """Truth: the quadratic interpolant of a rolled sheet has membrane strain of second order in
    the angle that a triangle spans; projected it is of higher order."""
    strains = []
    for radius in (2.0, 4.0):
        domain, projected, full, position = one_triangle(0)
        position.interpolate(
            lambda x, r=radius: np.array([r * np.sin(x[0] / r), x[1], r * (1 - np.cos(x[0] / r))])
        )
        dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 4})
        identity = ufl.Identity(2)
        strains.append(
            [
                np.sqrt(integral(ufl.inner(c - identity, c - identity), dx))
                for c in (full, projected)
            ]
        )
    order = np.log2(np.divide(*strains))
    assert strains[1][1] < 0.2 * strains[1][0]
    assert order[0] == pytest.approx(2, abs=0.2)
    assert order[1] > 3.5
