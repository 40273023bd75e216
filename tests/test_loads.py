"""Follower pressure and free-edge force against swept volumes and resultants."""

from __future__ import annotations

import numpy as np
import pytest

from avneo_fem.compat import ufl
from avneo_fem.equilibrium.shell_model import ShellModel
from avneo_fem.mechanics.loads import free_edge_energy_density, pressure_force_density
from avneo_fem.meshing.cusp_mesh import CuspMesh
from shell_cases import (
    FREE_EDGE_ALONE,
    PRESSURE_ALONE,
    Floats,
    disc,
    evaluated,
    flat,
    merit,
    rotation,
    rough,
    shell,
    state_at,
    strip,
    taylor_orders,
    unit_direction,
)

P = 8.0
BENDING = [True, False]


def rim(mesh: CuspMesh) -> np.ndarray:
    """Boundary nodes, counter-clockwise and closed."""
    return np.r_[mesh.suture_line, mesh.free_edge[::-1][1:]]


def forces(model: ShellModel, state: Floats) -> Floats:
    """(n, 3) forces of the load on the nodes."""
    return -model.residual(state)[model.position_dofs]


def swept(model: ShellModel, end: Floats, start: Floats) -> float:
    """Volume below ``end`` minus that below ``start`` by the divergence theorem (same rim)."""

    def below(state: Floats) -> float:
        a, b, c = (state[model.position_dofs][model.mesh.triangles[:, k]] for k in range(3))
        return float(np.einsum("nd,nd->", a, np.cross(b, c)) / 6)

    return below(end) - below(start)


def test_pressure_acts_against_the_normal() -> None:
    """Truth: force per reference area is -P J n for a stretched, tilted patch."""
    f = np.random.default_rng(0).normal(size=(3, 2))
    value = evaluated(pressure_force_density(ufl.as_matrix(f.tolist()), P))
    np.testing.assert_allclose(value, -P * np.cross(f[:, 0], f[:, 1]), rtol=1e-13)


@pytest.mark.parametrize("bending", BENDING)
@pytest.mark.parametrize("seed", [1, 2])
def test_pressure_taylor(bending: bool, seed: int) -> None:
    """Truth: on the straight way from a base, pressure work is a potential of the force at the
    base; the tangent is the derivative of the force."""
    model = shell(disc(2), bending=bending, **PRESSURE_ALONE)
    base = rough(model, seed)
    way = unit_direction(model, seed)
    slope = model.residual(base) @ way
    assert taylor_orders(merit(model, base), slope, base, way) == pytest.approx(2, abs=0.05)
    change = model.tangent(base) @ way
    assert taylor_orders(model.residual, change, base, way) == pytest.approx(2, abs=0.05)


def test_work_is_a_potential_all_along_a_straight_step() -> None:
    """Truth: d/ds work(base + s d) = force(base + s d).d, exactly, by Gauss's rule over s."""
    model = shell(disc(2), bending=False, **PRESSURE_ALONE)
    base, way = rough(model, 3), unit_direction(model, 4)
    nodes, weights = np.polynomial.legendre.leggauss(3)
    share = (nodes + 1) / 2
    power = [-model.residual(base + s * way) @ way for s in share]
    assert model.pressure_work(base + way, base) == pytest.approx(np.dot(weights, power) / 2)


@pytest.mark.parametrize("bending", BENDING)
def test_work_of_a_translation(bending: bool) -> None:
    """Truth: -P * (area vector) . t, here for a tilted flat template and any direction t."""
    mesh = strip(4, 3, 2.0, 1.0)
    model = shell(mesh, bending=bending, **PRESSURE_ALONE)
    q, t = rotation(2), np.array([0.3, -1.0, 2.0])
    start, end = (state_at(model, flat(mesh) @ q.T + s) for s in (0.0, t))
    expected = -P * 2.0 * q[:, 2] @ t
    assert model.pressure_work(end, start) == pytest.approx(expected)
    assert model.pressure_work(start, end) == pytest.approx(-expected)


def test_paraboloid_and_spherical_cap() -> None:
    """Truth: swept volumes pi a R^2/2 and pi h^2 (3 rho - h)/3; second order under refinement,
    and to rounding that of the polyhedra (which the sideways moves to the cap do not change)."""
    errors = []
    for rings in (4, 8, 16):
        mesh = disc(rings)
        model = shell(mesh, bending=False, **PRESSURE_ALONE)
        x, y = mesh.points.T
        r = np.hypot(x, y)
        start = state_at(model, flat(mesh))
        bowl = state_at(model, np.c_[x, y, 0.7 * (1 - r**2)])
        rho, opening = 1.25, np.arcsin(0.8)  # sphere through the rim, cap of height 0.5
        stretch = rho * np.sin(opening * r) / np.maximum(r, 1e-30)
        height = rho * (np.cos(opening * r) - np.cos(opening))
        cap = state_at(model, np.c_[stretch * x, stretch * y, height])
        volumes = np.array([swept(model, end, start) for end in (bowl, cap)])
        work = np.array([model.pressure_work(end, start) for end in (bowl, cap)])
        np.testing.assert_allclose(work, -P * volumes, rtol=1e-12)
        exact = -P * np.pi * np.array([0.35, 0.25 * (3 * 1.25 - 0.5) / 3])
        errors.append(np.abs(work / exact - 1))
    assert np.max(errors[-1]) < 0.01
    assert np.log2(errors[0] / errors[-1]) / 2 == pytest.approx(2, abs=0.25)


def test_work_does_not_depend_on_the_base_where_the_rim_is_held() -> None:
    """Truth: for surfaces with one rim the work is a difference of volumes, so detours are free;
    where the rim moves they are not."""
    model = shell(disc(3), bending=False, **PRESSURE_ALONE)
    a = rough(model, 1)
    b, c = (a + 0.3 * unit_direction(model, k) for k in (2, 3))
    detour = model.pressure_work(c, b) + model.pressure_work(b, a)
    assert abs(detour - model.pressure_work(c, a)) > 1e-3
    held = model.position_dofs[rim(model.mesh)]
    b[held], c[held] = a[held], a[held]
    direct = model.pressure_work(c, a)
    assert direct == pytest.approx(-P * swept(model, c, a), rel=1e-10)
    assert model.pressure_work(c, b) + model.pressure_work(b, a) == pytest.approx(direct, rel=1e-10)


@pytest.mark.parametrize("seed", [1, 2])
def test_pressure_resultant(seed: int) -> None:
    """Truth: the resultant is -P times the area vector of the rim, whatever spans it; the nodal
    forces are thirds of the oriented areas (1.4)."""
    model = shell(disc(3), bending=False, **PRESSURE_ALONE)
    state = rough(model, seed)
    points, triangles = state[model.position_dofs], model.mesh.triangles
    edge = points[rim(model.mesh)]
    area = np.cross(edge[:-1], edge[1:]).sum(axis=0) / 2
    np.testing.assert_allclose(forces(model, state).sum(axis=0), -P * area, atol=1e-10)
    a, b, c = (points[triangles[:, k]] for k in range(3))
    nodal = np.zeros_like(points)
    np.add.at(nodal, triangles.ravel(), np.repeat(-P * np.cross(b - a, c - a) / 6, 3, axis=0))
    np.testing.assert_allclose(forces(model, state), nodal, atol=1e-10)


# -- free edge ---------------------------------------------------------------------------------
def standing(mesh: CuspMesh, point: Floats, axes: Floats, level: float, sag: float) -> Floats:
    """Template upright on the plane of commissures, lowered by ``sag``."""
    along, normal = axes[:, 0], axes[:, 2]
    return point + mesh.points[:, :1] * along + (mesh.points[:, 1:] - level - sag) * normal


@pytest.mark.parametrize("sag", [-0.2, -0.04, 0.0, 0.3])
@pytest.mark.parametrize("bending", BENDING)
def test_free_edge_resultant(bending: bool, sag: float) -> None:
    """Truth (1.6): a uniform sag gives eta_1 S^0 f(-sag) n in total, each node its share
    (sum of adjacent lengths) / (2 L_free), nodes off the free edge nothing."""
    mesh, axes, point, level = disc(3), rotation(4), np.array([1.0, 2.0, 3.0]), 0.25
    model = shell(
        mesh,
        bending=bending,
        **FREE_EDGE_ALONE | {"free_edge_stiffness": 80.0},
        free_edge_width=0.1,
        free_edge_clearance=0.02,
        plane_point=tuple(point),
        plane_normal=tuple(axes[:, 2]),
        template_level=level,
    )
    load = forces(model, state_at(model, standing(mesh, point, axes, level, sag)))
    total = 80.0 * mesh.area * max(1 - 2 * (-sag - 0.02) / 0.1, 0.0)
    np.testing.assert_allclose(load.sum(axis=0), total * axes[:, 2], atol=1e-9)
    length = np.linalg.norm(np.diff(mesh.points[mesh.free_edge], axis=0), axis=1)
    share = np.zeros(len(mesh.points))
    share[mesh.free_edge] = (np.r_[length, 0] + np.r_[0, length]) / (2 * length.sum())
    np.testing.assert_allclose(load, total * share[:, None] * axes[:, 2], atol=1e-9)
    assert (total == 0) == (sag == -0.2)


def test_free_edge_density() -> None:
    """Truth: -d/dd of the density is stiffness * f(d), f as in (1.6b), 0 beyond d_0 + width/2."""
    for d in (-0.3, 0.0, 0.04, 0.2):
        variable = ufl.variable(ufl.as_ufl(d))
        density = free_edge_energy_density(variable, 50.0, 0.1, 0.01)
        slope = evaluated(ufl.diff(density, variable))
        assert -slope == pytest.approx(50.0 * max(1 - 2 * (d - 0.01) / 0.1, 0.0), abs=1e-12)


@pytest.mark.parametrize("bending", BENDING)
def test_free_edge_taylor(bending: bool) -> None:
    """Truth: the force is the derivative of the energy, and piecewise linear: its tangent
    predicts a change exactly while no quadrature point crosses the ramp's end."""
    model = shell(disc(2), bending=bending, **FREE_EDGE_ALONE, template_level=0.5)
    sagged = standing(model.mesh, np.zeros(3), np.eye(3), 0.5, 0.2)
    state, way = state_at(model, sagged), unit_direction(model, 2)
    slope = model.residual(state) @ way
    assert slope != 0
    assert taylor_orders(model.energy, slope, state, way) == pytest.approx(2, abs=0.05)
    change = model.tangent(state) @ way
    assert np.abs(change).max() > 1
    found = model.residual(state + 0.01 * way) - model.residual(state)
    np.testing.assert_allclose(found, 0.01 * change, atol=1e-9)


def test_setters_scale_the_loads() -> None:
    """Truth: both loads are proportional to the constants that can be set between solves."""
    model = shell(disc(2), bending=False, **PRESSURE_ALONE)
    state = rough(model, 1)
    before = forces(model, state)
    model.pressure = 3 * P
    assert model.pressure == 3 * P
    np.testing.assert_allclose(forces(model, state), 3 * before, rtol=1e-12)
    model.pressure = 0.0
    state[model.position_dofs[:, 2]] -= 3.0
    model.free_edge_stiffness = 10.0
    first = forces(model, state)
    model.free_edge_stiffness = 25.0
    assert model.free_edge_stiffness == 25.0
    assert np.abs(first).max() > 1
    np.testing.assert_allclose(forces(model, state), 2.5 * first, rtol=1e-12)
