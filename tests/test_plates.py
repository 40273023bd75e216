"""Plates against the textbook, and the independent reference for large deflections itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.polynomial import Legendre, Polynomial

import plates
import plates_small
from avneo_fem.compat import ufl
from cell_fields import value_at
from linear_response import follower_load, respond
from meshes import disc
from plate_problems import RIGIDITY, SIZE, square_plate
from plate_reference import CircularPlate, perturbation_coefficient
from record import Row
from solving import start


def failures(table: list[Row], start_of_case: str) -> list[Row]:
    chosen = [row for row in table if row.case.startswith(start_of_case)]
    assert chosen
    return [row for row in chosen if not row.passed]


@pytest.fixture(scope="module")
def table() -> list[Row]:
    return plates.rows(full=False)


@pytest.mark.parametrize("support", ["clamped", "hinged"])
def test_circular_plates_bend_as_the_textbook_says(table: list[Row], support: str) -> None:
    """w = q a^4/64D and 5 times that; clamp moment q a^2/8, rim slope q a^3/8D (nu = 0)."""
    assert failures(table, f"circular, {support}, small") == []


@pytest.mark.parametrize("support", ["clamped", "hinged"])
def test_square_plates_bend_as_the_textbook_says(table: list[Row], support: str) -> None:
    """w = 0.00126532 and 0.00406235 q a^4/D."""
    assert failures(table, f"square, {support}, small") == []


def test_the_deflection_of_squares_converges_at_twice_the_degree(table: list[Row]) -> None:
    """Order 2k, that of the energy, for k = 1, 2, 3."""
    orders = [row for row in table if row.quantity.startswith("order")]
    assert len(orders) == 3
    assert [row for row in orders if not row.passed] == []


@pytest.mark.parametrize("support", ["clamped", "hinged"])
def test_large_deflections_follow_the_exact_shell(table: list[Row], support: str) -> None:
    """w/H up to 1.7 against the axisymmetric Kirchhoff-Love shell solved as an ODE."""
    assert failures(table, f"circular, {support}, q a^4") == []


def test_dead_and_follower_pressure_agree_on_the_flat_plate() -> None:
    """The follower pressure -n at the flat state is the dead load (0, 0, q), and lifts alike."""
    for degree in (1, 2, 3):
        plate = square_plate(degree, 2, clamped=True)
        follower = follower_load(plate.problem, -1.0)
        dead = plate.problem.surface_load(ufl.as_vector([0.0, 0.0, 1.0]))
        np.testing.assert_allclose(follower, dead, atol=1e-12 * np.abs(dead).max())


def test_a_hinged_polygon_that_is_fully_resolved_stays_too_stiff() -> None:
    """Babuska's paradox: the boundary of a 12-gon held all along, meshed finer and finer, leaves
    5 q a^4/64D, the value of the disc, for good, and falls towards 3 (nu = 1)."""
    sides, found = 12, []
    for rings in (2, 4, 8):
        mesh = disc(rings, SIZE)
        angle = np.arctan2(*mesh.points.T[::-1]) % (2 * np.pi / sides) - np.pi / sides
        shrink = np.cos(np.pi / sides) / np.cos(angle)
        area = np.sqrt(2 * np.pi / (sides * np.sin(2 * np.pi / sides)))
        mesh = replace(mesh, points=mesh.points * (area * shrink)[:, None])
        problem = start(mesh, 2, force_scale=1.0, thickness=0.5, young_modulus=1000.0)
        rim = np.cos(np.pi / sides) * area * SIZE

        def on_rim(places: np.ndarray, rim: float = rim) -> np.ndarray:
            turn = np.arctan2(*places.T[::-1]) % (2 * np.pi / sides) - np.pi / sides
            return np.hypot(*places.T) * np.cos(turn) > rim * (1 - 1e-9)

        problem.hold(on_rim)
        response = respond(problem, follower_load(problem, -1.0))
        lift = value_at(problem.model, response[problem.model.position_dofs], (0.0, 0.0))[2]
        found.append(lift * 64 * RIGIDITY / SIZE**4)
    assert found[0] > found[1] > found[2]
    assert 3.0 < found[2] < 3.6


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3])
def test_the_reference_starts_as_the_perturbation_solution(poisson_ratio: float) -> None:
    """q a^4/64DH = w/H + c (w/H)^3 with c = (1 + nu)(173 - 73 nu)/360, the exact third-order
    term of von Karman's clamped plate, both by polynomials and in the ODE's solution."""
    exact = (1 + poisson_ratio) * (173 - 73 * poisson_ratio) / 360
    assert perturbation_coefficient(poisson_ratio) == pytest.approx(exact, rel=1e-12)
    load = 0.05
    height = CircularPlate(0.002, True, poisson_ratio).deflections(np.array([load]))[0]
    assert (load - height) / height**3 == pytest.approx(exact, rel=2e-3)


def test_the_reference_is_near_timoshenkos_cubic() -> None:
    """w/H + 0.488 (w/H)^3 = q a^4/64DH (nu = 0.3, one term of an energy method): within 3 % up to
    w/H = 0.76."""
    loads = np.array([0.25, 0.5, 1.0])
    height = CircularPlate(0.002, True, 0.3).deflections(loads)
    np.testing.assert_allclose(height + 0.488 * height**3, loads, rtol=0.03)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.3])
def test_the_reference_bends_as_a_hinged_plate_under_small_loads(poisson_ratio: float) -> None:
    """w = (5 + nu)/(1 + nu) q a^4/64D."""
    plate = CircularPlate(0.02, False, poisson_ratio)
    factor = (5 + poisson_ratio) / (1 + poisson_ratio)
    assert plate.deflections(np.array([1e-3]))[0] == pytest.approx(1e-3 * factor, rel=1e-4)


def ritz_clamped_square(number: int) -> float:
    """w D/(q a^4) in the centre, from products of (1 - t^2)^2 P_2k(t), k < number."""
    t, weight = np.polynomial.legendre.leggauss(2 * number + 8)
    bump = Polynomial([1.0, 0.0, -1.0]) ** 2
    shapes = [bump * Legendre.basis(2 * k).convert(kind=Polynomial) for k in range(number)]
    values, slopes, bends = (
        np.array([(shape.deriv(d) if d else shape)(t) for shape in shapes]) for d in (0, 1, 2)
    )
    middle = np.array([shape(0.0) for shape in shapes])
    root = np.linalg.inv(np.linalg.cholesky((bends * weight) @ bends.T))
    values, slopes, bends, middle = root @ values, root @ slopes, root @ bends, root @ middle
    mass, bend, slope = ((k * weight) @ k.T for k in (values, bends, slopes))
    stiffness = np.kron(bend, mass) + np.kron(mass, bend) + 2 * np.kron(slope, slope)
    load = np.kron(values @ weight, values @ weight)
    return float(np.kron(middle, middle) @ np.linalg.solve(stiffness, load)) / 16


def test_the_targets_of_squares_have_the_digits_they_show() -> None:
    """Clamped: Ritz solution with polynomials; hinged: Navier's double sine series."""
    assert ritz_clamped_square(12) == pytest.approx(plates_small._SQUARE[True], rel=1e-8)
    m = np.arange(1, 400, 2)
    signs = np.sin(m * np.pi / 2)
    terms = np.outer(signs, signs) / (np.outer(m, m) * (m[:, None] ** 2.0 + m**2) ** 2)
    navier = 16 / np.pi**6 * float(terms.sum())
    assert navier == pytest.approx(plates_small._SQUARE[False], rel=1e-8)


@pytest.mark.slow
def test_all_plates() -> None:
    """Every row of the table, finest meshes and all loads, and the orders on circles."""
    assert [row for row in plates.rows(full=True) if not row.passed] == []
