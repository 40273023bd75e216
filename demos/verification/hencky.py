"""A circular membrane blown up: Hencky's problem, and large inflation.

A flat, unstressed circular membrane of radius a = 10 mm, thickness H = 0.5 mm, E = 1000 kPa,
nu = 0 is held at its rim and loaded by a pressure q. There is no bending stiffness, so the flat
membrane carries nothing at all: the solver starts from a shallow paraboloid.

*Small strains* (Hencky 1915). With rho = r/a and a dead load normal to the plane, the membrane
stress sigma_r = 1/4 (E q^2 a^2/H^2)^(1/3) N(rho) and the deflection w obey

    rho d/drho (2 N + rho N') = -8 rho^2/N^2,        dw/dr = -q r/(2 H sigma_r),

which even power series solve: N = sum b_2n rho^2n with n (n + 1) b_2n = -2 [1/N^2]_(2n-2), and
w = a (q a/(E H))^(1/3) sum a_2n (1 - rho^(2n+2)) with a_2n = [1/N]_2n/(n + 1). The rim does not
move: sum (2n + 1 - nu) b_2n = 0 gives b_0. For nu = 0.2, 0.3, 0.4 that is 1.6827, 1.7244, 1.7769
(Fichter, NASA TP-3658, 1997); for nu = 0 it is b_0 = 1.62041, so

    w(0) = 0.71832 a (q a/(E H))^(1/3),    sigma_r(a) = 0.28937 (E q^2 a^2/H^2)^(1/3).

*Large strains*: the pressure follows the surface and the strains are those of the two materials.
A ring at R moves to radius rho, height z, with stretches lambda_1 = sqrt(rho'^2 + z'^2),
lambda_2 = rho/R and forces T_i = H P(lambda_i) per reference length, P = E (lambda^3 - lambda)/2
(St. Venant-Kirchhoff) or E (lambda - 1/lambda)/2 (neo-Hookean). With phi the slope of the meridian,

    R T_1 sin(phi) = q rho^2/2,    (R T_1 cos(phi))' = T_2 - q rho lambda_1 sin(phi),

integrated to 1e-12 from the pole, where lambda_1 = lambda_2 is chosen, to the ring that has
lambda_2 = 1: that ring is the rim, and its R tells q a. At the pole a closed form holds whatever
the rest does, N = q R_c/2 with the radius of curvature R_c, as in a sphere; and the rim carries
q pi a^2 upwards.

Hencky's problem is computed at q a/(E H) near 1e-6, strains of 4e-5; the large-strain equations,
extrapolated to q = 0 from two small loads, must give Hencky's numbers, dead load or following.

The mesh is a polygon; it is given the area of the disc, else the missing slivers (of order h^2)
would hide the order of the quadratic elements. Its straight sides still cost cubic ones their gain.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from avneo_fem.compat import ufl
from cell_fields import value_at
from meshes import disc
from record import Row
from solving import Problem, start

__all__ = [
    "MATERIALS",
    "STRETCHES",
    "Inflation",
    "Measured",
    "draw",
    "hencky_case",
    "hencky_series",
    "inflate",
    "inflated",
    "inflation_case",
    "rows",
]

Floats = NDArray[np.float64]
RADIUS, THICKNESS, MODULUS = 10.0, 0.5, 1000.0  # mm, mm, kPa
MATERIALS = ("st_venant_kirchhoff", "neo_hookean")
SMALL_STRETCH = 1.00004  # of the pole in Hencky's problem, at q a/(E H) near 1e-6
#: Inflations by the stretch of the pole; 2.4 is at 0.70 E H/a, near the most the neo-Hookean bears
STRETCHES = {MATERIALS[0]: (1.05, 1.5, 2.0), MATERIALS[1]: (1.05, 1.5, 2.0, 2.4)}


# -- references ----------------------------------------------------------------------------------
def hencky_series(poisson_ratio: float = 0.0, terms: int = 60) -> tuple[Floats, Floats]:
    """Coefficients b_2n of the stress and a_2n of the deflection, (terms,) each."""

    def coefficients(first: float) -> tuple[Floats, Floats]:
        stress, inverse = np.zeros(terms), np.zeros(terms)
        stress[0], inverse[0] = first, 1 / first
        for n in range(1, terms):
            stress[n] = -2 * inverse[:n] @ inverse[:n][::-1] / (n * (n + 1))
            inverse[n] = -stress[1 : n + 1] @ inverse[:n][::-1] / first
        return stress, inverse

    def rim_movement(first: float) -> float:
        return float((2 * np.arange(terms) + 1 - poisson_ratio) @ coefficients(first)[0])

    stress, inverse = coefficients(brentq(rim_movement, 1.45, 2.5, xtol=1e-15))
    return stress, inverse / np.arange(1, terms + 1)


def _nominal(material: str, stretch: Any) -> Any:
    """P/E of a principal stretch."""
    return (stretch**3 - stretch) / 2 if material == MATERIALS[0] else (stretch - 1 / stretch) / 2


def _stretch(material: str, nominal: float) -> float:
    """Inverse of :func:`_nominal` in tension, P/E >= 0."""
    if material == MATERIALS[1]:
        return nominal + np.sqrt(nominal**2 + 1)
    turn = np.sqrt(27) * nominal  # Cardano's formula
    third = np.cosh(np.arccosh(turn) / 3) if turn > 1 else np.cos(np.arccos(turn) / 3)
    return float(2 / np.sqrt(3) * third)


def _energy(material: str, stretch: float) -> float:
    """psi/E of a principal stretch (the energy of two is the sum)."""
    if material == MATERIALS[0]:
        return (stretch**2 - 1) ** 2 / 8
    return (stretch**2 - 1) / 4 - np.log(stretch) / 2


@dataclass(frozen=True)
class Inflation:
    """Axisymmetric solution, in units of a, E H, E H/a and E H a^2.

    ``rim_force`` is T_1 at the rim; ``profile`` holds (radius, height) from pole to rim, (k, 2).
    """

    material: str
    pole_stretch: float
    pressure: float
    height: float
    rim_force: float
    energy: float
    profile: Floats


def inflated(material: str, pole_stretch: float, dead: bool = False) -> Inflation:
    """Solution for the pressure at which the pole has this stretch (module docstring).

    ``dead`` for a load that stays normal to the template, on its reference area.
    """

    def change(place: float, y: Floats) -> list[float]:
        radius, across, _, _ = y
        up = (place if dead else radius) ** 2 / 2
        force = np.hypot(across, up) / place
        stretch = _stretch(material, force)
        cosine, sine = across / (place * force), up / (place * force)
        hoop = radius / place
        stored = 2 * np.pi * place * (_energy(material, stretch) + _energy(material, hoop))
        push = 0.0 if dead else radius * stretch * sine
        return [stretch * cosine, _nominal(material, hoop) - push, -stretch * sine, stored]

    def rim(place: float, y: Floats) -> float:
        return y[0] / place - 1

    rim.terminal = True  # type: ignore[attr-defined]
    tension = _nominal(material, pole_stretch)
    first = 1e-6 * tension**1.5  # about 1e-6 a, and the error is of its square
    begin = [pole_stretch * first, tension * first, 0.0, 0.0]
    found = solve_ivp(
        change,
        (first, 100.0),
        begin,
        "DOP853",
        events=rim,
        rtol=1e-12,
        atol=1e-20,
        dense_output=True,
    )
    edge = float(found.t_events[0][0])
    radius, across, depth, stored = found.y_events[0][0]
    places = np.linspace(first, edge, 101)
    line = (found.sol(places)[[0, 2]].T - [0.0, depth]) / edge
    return Inflation(
        material,
        pole_stretch,
        edge,
        -depth / edge,
        float(np.hypot(across, radius**2 / 2) / edge),
        stored / edge**2,
        line,
    )


# -- finite elements -----------------------------------------------------------------------------
def _rim(rings: int) -> Any:
    """Places on the boundary of the polygon :func:`meshes.disc` with the area of the disc."""
    sides = 6 * rings
    outer = RADIUS * np.sqrt(2 * np.pi / sides / np.sin(2 * np.pi / sides))

    def where(places: Floats) -> NDArray[np.bool_]:
        angle = np.arctan2(places[:, 1], places[:, 0]) % (2 * np.pi / sides) - np.pi / sides
        inside = np.linalg.norm(places, axis=1) * np.cos(angle)
        return np.asarray(inside > outer * np.cos(np.pi / sides) - 1e-6)

    return outer, where


@dataclass(frozen=True)
class Measured:
    """What the computed membrane shows, in the units of :class:`Inflation`.

    ``curvature_law`` is q R_c/(2 N) at the pole, which must be 1; ``lift`` the vertical rim force
    over q pi a^2.
    """

    pressure: float
    height: float
    pole_stretch: float
    rim_force: float
    energy: float
    curvature_law: float
    lift: float
    positions: Floats


def _measure(problem: Problem, rings: int, material: str, pressure: float) -> Measured:
    model, points = problem.model, problem.positions / RADIUS
    places = model.node_points / RADIUS
    around, radius = (np.linalg.norm(x[:, :2], axis=1) for x in (places, points))
    near = (around < 0.4) & (around > 1e-9)
    square = around[near] ** 2  # radius/R and height are even functions of R
    stretch = np.polynomial.Polynomial.fit(square, radius[near] / around[near], 3)(0.0)
    fall = np.polynomial.Polynomial.fit(square, points[near, 2], 3).deriv()(0.0)
    curvature = -2 * fall / stretch**2
    held = problem.nodes(_rim(rings)[1])
    reaction = problem.system.residual(problem.state)[model.position_dofs[held]]
    outward = (reaction[:, :2] * places[held] / around[held, None]).sum()
    unit = 2 * np.pi * RADIUS * MODULUS * THICKNESS
    total = np.hypot(outward, reaction[:, 2].sum()) / unit
    return Measured(
        pressure,
        float(value_at(model, points, (0.0, 0.0))[2]),
        float(stretch),
        float(total),
        model.energy(problem.state) / (MODULUS * THICKNESS * RADIUS**2),
        float(pressure / curvature / (2 * _nominal(material, stretch) / stretch)),
        float(-reaction[:, 2].sum() / unit / (pressure / 2)),
        points,
    )


def inflate(
    rings: int,
    degree: int,
    material: str,
    pressure: float,
    guess: float,
    dead: bool = False,
) -> Measured:
    """Membrane of 6 rings^2 triangles under ``pressure`` q a/(E H), from a paraboloid of height
    ``guess`` a; ``dead`` for a load normal to the template, else one that follows the surface."""
    outer, rim = _rim(rings)
    unit = MODULUS * THICKNESS / RADIUS
    problem = start(
        disc(rings, outer),
        degree,
        force_scale=pressure * unit * np.pi * RADIUS**2,
        material=material,
        bending=False,
        young_modulus=MODULUS,
        thickness=THICKNESS,
    )
    model = problem.model
    problem.hold(rim)
    height = guess * RADIUS * (1 - (model.node_points**2).sum(axis=1) / RADIUS**2)
    height[problem.nodes(rim)] = 0.0
    problem.state[model.position_dofs[:, 2]] = height
    if dead:
        force = problem.surface_load(ufl.as_vector([0.0, 0.0, 1.0]))
        problem.system.dead_load = pressure * unit * force
    else:
        model.pressure = -pressure * unit  # the normal points up, the pressure pushes up
    problem.solve(1e-8)
    return _measure(problem, rings, material, pressure)


# -- the table -----------------------------------------------------------------------------------
def hencky_case(rings: int, degree: int, dead: bool = True) -> tuple[Inflation, Measured]:
    """Hencky's problem: finite-strain reference, and computed at the same pressure."""
    exact = inflated(MATERIALS[0], SMALL_STRETCH, dead)
    return exact, inflate(rings, degree, MATERIALS[0], exact.pressure, exact.height, dead)


def inflation_case(
    rings: int, degree: int, material: str, pole_stretch: float
) -> tuple[Inflation, Measured]:
    """Large inflation: reference, and computed at the same pressure."""
    exact = inflated(material, pole_stretch)
    return exact, inflate(rings, degree, material, exact.pressure, exact.height)


_QUANTITIES = ("w(0)/[a (qa/EH)^(1/3)]", "sigma_r(a)/(E q^2 a^2/H^2)^(1/3)", "b_0")


def _in_henckys_units(found: Inflation | Measured) -> Floats:
    """Height, rim stress and pole stress of a small inflation as ``_QUANTITIES``, (3,)."""
    pole = 4 * _nominal(MATERIALS[0], found.pole_stretch)
    third = found.pressure ** (1 / 3)
    return np.array([found.height / third, found.rim_force / third**2, pole / third**2])


def _hencky_rows(name: str, levels: list[tuple[int, int, tuple[float, ...]]]) -> list[Row]:
    result = []
    for ratio, published in ((0.2, 1.6827), (0.3, 1.7244), (0.4, 1.7769)):
        first, source = float(hencky_series(ratio)[0][0]), "Fichter, NASA TP-3658 (1997)"
        result.append(Row(name, f"series, nu {ratio}", "b_0", first, published, 5e-5, source, True))
    stress, deflection = hencky_series()
    targets = np.array([deflection.sum(), stress.sum() / 4, stress[0]])

    def add(case: str, values: Floats, tolerances: tuple[float, ...]) -> None:
        for quantity, *numbers in zip(_QUANTITIES, values, targets, tolerances, strict=True):
            result.append(Row(name, case, quantity, *numbers, "Hencky's series, nu = 0"))

    for dead in (True, False):
        near, far = (_in_henckys_units(inflated(MATERIALS[0], 1 + e, dead)) for e in (1e-4, 2e-4))
        # what finite strains change is proportional to the strain
        case = f"finite-strain equations, {'dead' if dead else 'follower'} load, q -> 0"
        add(case, 2 * near - far, (1e-6, 1e-6, 1e-6))
    for degree, rings, tolerances in levels:
        case = f"degree {degree}, {6 * rings**2} triangles"
        add(case, _in_henckys_units(hencky_case(rings, degree)[1]), tolerances)
    degree, rings, tolerances = levels[-1]
    case = f"degree {degree}, {6 * rings**2} triangles, follower load"
    add(case, _in_henckys_units(hencky_case(rings, degree, False)[1]), tolerances)
    return result


def _inflation_rows(
    name: str, degree: int, rings: int, stretch: float, tolerances: tuple[float, ...]
) -> list[Row]:
    result = []
    for material in MATERIALS:
        if stretch not in STRETCHES[material]:
            continue
        exact, found = inflation_case(rings, degree, material, stretch)
        case = f"{material}, pole stretched {stretch}: degree {degree}, {6 * rings**2} triangles"
        source = "axisymmetric membrane equations, integrated to 1e-12"
        for quantity, tolerance in zip(("height", "rim_force", "energy"), tolerances, strict=False):
            numbers = getattr(found, quantity), getattr(exact, quantity), tolerance
            result.append(Row(name, case, quantity.replace("_", " "), *numbers, source))
        law = Row(
            name, case, "q R/(2 N) at the pole", found.curvature_law, 1, tolerances[3], "N = q R/2"
        )
        lift = Row(name, case, "rim's lift/(q pi a^2)", found.lift, 1, 1e-6, "vertical equilibrium")
        result += [law, lift]
    return result


def rows(full: bool = False) -> list[Row]:
    """Hencky's problem (height, rim and pole stress) and large inflations (height/a, rim force/EH,
    energy/EHa^2, the law of the sphere at the pole, lift of the rim)."""
    levels = [(1, 16, (1e-3, 3e-3, 2e-3)), (2, 8, (5e-5, 5e-4, 3e-4))]
    if full:
        levels += [(1, 32, (3e-4, 1e-3, 1e-3)), (3, 8, (5e-5, 3e-4, 3e-4))]
        levels += [(2, 16, (2e-5, 2e-4, 2e-4))]
    result = _hencky_rows("Hencky's membrane", levels)
    # per pole stretch: height, rim force, energy, law of the sphere; the last two of the
    # neo-Hookean are where its pressure hardly rises, so that heights feel the mesh more
    inflations = {
        (2, 8): {
            1.05: (5e-5, 5e-4, 5e-4, 2e-4),
            1.5: (1e-4, 1e-5, 5e-4, 2e-4),
            2.0: (3e-4, 1e-4, 1e-3, 1e-3),
        },
        (1, 16): {1.5: (1e-3, 1e-4, 1e-2, 1e-2)},
    }
    if full:
        inflations[2, 8][2.4] = (1e-3, 5e-4, 2e-3, 2e-3)
        inflations[2, 16] = {
            1.05: (5e-6, 5e-5, 1e-4, 1e-4),
            1.5: (2e-5, 1e-6, 1e-4, 1e-4),
            2.0: (5e-5, 1e-5, 1e-4, 2e-4),
            2.4: (1e-4, 5e-5, 2e-4, 1e-3),
        }
        inflations[1, 32] = {
            1.05: (3e-4, 1e-3, 1e-3, 2e-3),
            1.5: (3e-4, 3e-5, 2e-3, 1e-3),
            2.0: (2e-3, 5e-4, 5e-3, 1e-3),
            2.4: (5e-3, 2e-3, 2e-2, 1e-3),
        }
    for (degree, rings), cases in inflations.items():
        for stretch, tolerances in cases.items():
            result += _inflation_rows("Inflated membrane", degree, rings, stretch, tolerances)
    return result


def draw(axes: Any) -> None:
    """Inflated shapes: equations (lines) and 96 quadratic triangles (dots)."""
    for material, colour in zip(MATERIALS, ("tab:blue", "tab:red"), strict=True):
        for stretch in STRETCHES[material]:
            exact, found = inflation_case(4, 2, material, stretch)
            label = material.replace("_", " ") if stretch == 1.5 else None
            axes.plot(*(RADIUS * exact.profile.T), color=colour, linewidth=1, label=label)
            radius = np.linalg.norm(found.positions[:, :2], axis=1)
            height = found.positions[:, 2]
            axes.plot(RADIUS * radius, RADIUS * height, ".", color=colour, markersize=3)
    axes.set(xlabel="distance from the axis [mm]", ylabel="height [mm]", aspect="equal")
    axes.set_title("Flat membrane, inflated: pole stretch 1.05 to 2.4")
    axes.legend()
