"""Flat membranes stretched and sheared, and a disc laid on a sphere.

*Homogeneous deformation.* A strip, 3 x 2 mm, H = 0.5 mm, E = 1000 kPa, nu = 0, of irregular
triangles, is deformed in its plane; what its held edges must bear is the nominal (first
Piola-Kirchhoff) stress P. With nu = 0 the principal directions do not interact:

    St. Venant-Kirchhoff  P = E (lambda^3 - lambda)/2,    neo-Hookean  P = E (lambda - 1/lambda)/2,

in uniaxial stretch (lambda, 1), equibiaxial (lambda, lambda) and pure shear (lambda, 1/lambda).
In simple shear by gamma the stresses P_11, P_12, P_21, P_22 are E (gamma^2, gamma + gamma^3,
gamma, gamma^2)/2 and E (0, gamma, gamma, 0)/2. Every degree must give them to rounding, from a
start in which the inner nodes are somewhere else.

In compression the nominal stress of St. Venant-Kirchhoff peaks at lambda = 1/sqrt(3) = 0.57735
with -E/(3 sqrt(3)). For a strip that can only move along, this is the limit: the computed tangent
must lose its definiteness there, and under a dead load of 99 % of the peak the stretch must be
the stable root of lambda^3 - lambda = 2 P/E. A strip that can move sideways fails earlier, in
oblique bands. The acoustic tensor, for bands with normal (c, s), is E/2 times

    [[(2 L - 1) c^2 + L, lambda c s], [lambda c s, (L - 2) c^2 + 2]],    L = lambda^2,

for a stretch (lambda, 1), and singular first at L = 6 - 4 sqrt(2), so at lambda = 2 - sqrt(2) =
0.58579, with c^2 = (L + 2)/(4 (1 - L)); for (lambda, lambda) it is singular at 1/sqrt(2) in all
directions. With its boundary held, a mesh resists a little longer; the finer, the less.

*A disc on a sphere.* The inverse stereographic projection lays a flat disc of radius a = 10 mm
on a sphere of radius rho = 8 mm; it stretches both directions by lambda = s/(1 + v), v = (s r/(2
rho))^2, s = 1.3. The membrane energy is pi H (2 rho/s)^2 times

    E/4 [s^4 (1 - 1/(1 + V)^3)/3 - 2 s^2 (1 - 1/(1 + V)) + V]                  (SVK)
    E/2 [s^2 (1 - 1/(1 + V)) - (1 + 2 ln s) V + 2 ((1 + V) ln(1 + V) - V)]     (neo-Hookean)

with V = v(a). The energy of the interpolated map must converge to it with order 2 in degree 1,
and faster than 3 in degree 2. (The polygon that stands for the disc has the disc's area.)
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cell_fields import boundary
from meshes import disc, strip
from record import Row
from solving import Problem, start

__all__ = [
    "MATERIALS",
    "cap_energy",
    "computed_cap_energy",
    "draw",
    "limit_stretch",
    "loaded_stretch",
    "nominal_stress",
    "rows",
    "stable_stretch",
    "strip_stress",
]

Floats = NDArray[np.float64]
LENGTH, WIDTH, THICKNESS, MODULUS = 3.0, 2.0, 0.5, 1000.0  # mm, mm, mm, kPa
MATERIALS = ("st_venant_kirchhoff", "neo_hookean")
RADIUS, SPHERE, SCALE = 10.0, 8.0, 1.3  # mm, mm, -
_SHEAR = 0.7
_ELLIPTICITY = {
    "uniaxial": (2 - np.sqrt(2), "loss of ellipticity, 2 - sqrt(2)"),
    "equibiaxial": (np.sqrt(0.5), "loss of ellipticity, 1/sqrt(2)"),
}
PEAK = -MODULUS / np.sqrt(27)  # kPa, the least nominal stress of St. Venant-Kirchhoff


def nominal_stress(material: str, gradient: Floats) -> Floats:
    """P [kPa] of an in-plane deformation gradient (2, 2), written out without the library."""
    if material == MATERIALS[0]:
        return MODULUS / 2 * gradient @ (gradient.T @ gradient - np.eye(2))
    return MODULUS / 2 * (gradient - np.linalg.inv(gradient).T)


# -- homogeneous deformation ---------------------------------------------------------------------
def _sides(places: Floats) -> NDArray[np.bool_]:
    """Whether places (k, 2) are on the boundary of the strip."""
    return boundary(places / [LENGTH, WIDTH])


def _flat_strip(
    degree: int, material: str, structured: bool = False, refinement: int = 1
) -> Problem:
    """The strip, kept in its plane."""
    problem = start(
        strip(6 * refinement, 4 * refinement, LENGTH, WIDTH, structured),
        degree,
        force_scale=MODULUS * THICKNESS * WIDTH,
        material=material,
        bending=False,
        young_modulus=MODULUS,
        thickness=THICKNESS,
    )
    problem.hold(lambda x: x[:, 0] > -1, (2,))
    return problem


def _deform(problem: Problem, gradient: Floats) -> None:
    problem.state[problem.model.position_dofs[:, :2]] = problem.model.node_points @ gradient.T


def strip_stress(degree: int, material: str, gradient: Floats) -> Floats:
    """P [kPa] (2, 2) from the reactions of a strip whose boundary is moved by ``gradient``."""
    problem = _flat_strip(degree, material)
    model = problem.model
    problem.hold(_sides)
    _deform(problem, gradient)
    inner = model.position_dofs[~_sides(model.node_points)][:, :2]
    move = 0.01 / degree * np.linalg.svd(gradient)[1].min()
    problem.state[inner] += move * np.random.default_rng(1).uniform(-1, 1, inner.shape)
    problem.solve(1e-12)
    # sum of reaction x place over the boundary is the volume times the mean stress
    reaction = problem.system.residual(problem.state)[model.position_dofs[:, :2]]
    return reaction.T @ model.node_points / (LENGTH * WIDTH * THICKNESS)


def _gradients() -> dict[str, Floats]:
    """Homogeneous deformations by name."""
    result = {}
    for stretch in (0.62, 0.8, 1.2, 1.6, 2.0):
        result[f"uniaxial {stretch}"] = np.diag([stretch, 1.0])
        if stretch > np.sqrt(0.5):  # below, St. Venant-Kirchhoff is unstable
            result[f"equibiaxial {stretch}"] = np.diag([stretch, stretch])
    for stretch in (1.2, 1.4):
        result[f"pure shear {stretch}"] = np.diag([stretch, 1 / stretch])
    return result | {f"simple shear {_SHEAR}": np.array([[1.0, _SHEAR], [0.0, 1.0]])}


def limit_stretch(degree: int, kind: str, refinement: int = 1) -> float:
    """Stretch below which the tangent of a strip is no longer positive definite.

    ``kind``: "along" (uniaxial, nothing moves sideways; its ends are held), "uniaxial" or
    "equibiaxial" (its whole boundary is held).
    """
    problem = _flat_strip(degree, MATERIALS[0], True, refinement)
    if kind == "along":
        problem.hold(lambda x: np.abs(x[:, 0] - LENGTH / 2) > LENGTH / 2 - 1e-9)
        problem.hold(lambda x: x[:, 1] > -1, (1,))
    else:
        problem.hold(_sides)
    free = problem.system.free
    low, high = 0.5, 0.8
    while high - low > 1e-11:
        middle = (low + high) / 2
        _deform(problem, np.diag([middle, middle if kind == "equibiaxial" else 1.0]))
        try:
            np.linalg.cholesky(problem.system.tangent(problem.state)[free][:, free].toarray())
            high = middle
        except np.linalg.LinAlgError:
            low = middle
    return (low + high) / 2


def loaded_stretch(degree: int, share: float) -> float:
    """Stretch of a strip under a dead load on its end, a ``share`` of the peak stress.

    It moves along only: free to move sideways it would buckle, and guided at its long sides its
    loaded end would still wrinkle from a stretch of 0.63 on.
    """
    problem = _flat_strip(degree, MATERIALS[0])
    problem.hold(lambda x: x[:, 0] < 1e-9, (0,))
    problem.hold(lambda x: x[:, 1] > -1, (1,))
    unit = problem.edge_load(lambda x: x[:, 0] > LENGTH - 1e-9, np.array([1.0, 0.0, 0.0]))
    for part in (0.5, 0.8, 0.95, 1.0):
        problem.system.dead_load = part * share * PEAK * THICKNESS * unit
        problem.solve(1e-12)
    right = problem.nodes(lambda x: x[:, 0] > LENGTH - 1e-9)
    return float(problem.positions[right, 0].mean() / LENGTH)


def stable_stretch(share: float) -> float:
    """The root of E (lambda^3 - lambda)/2 = share x peak above 1/sqrt(3), by Cardano's formula."""
    return float(2 / np.sqrt(3) * np.cos(np.arccos(-share) / 3))


# -- a disc on a sphere --------------------------------------------------------------------------
def cap_energy(material: str) -> float:
    """Closed form of the membrane energy [mN mm]."""
    v, s = (SCALE * RADIUS / (2 * SPHERE)) ** 2, SCALE
    if material == MATERIALS[0]:
        value = (s**4 * (1 - (1 + v) ** -3) / 3 - 2 * s**2 * (1 - 1 / (1 + v)) + v) / 4
    else:
        logarithm = 2 * ((1 + v) * np.log(1 + v) - v)
        value = (s**2 * (1 - 1 / (1 + v)) - (1 + 2 * np.log(s)) * v + logarithm) / 2
    return float(value * np.pi * MODULUS * THICKNESS * (2 * SPHERE / s) ** 2)


def computed_cap_energy(material: str, degree: int, rings: int) -> float:
    """The same of the interpolated map on 6 rings^2 triangles [mN mm]."""
    angle = np.pi / (3 * rings)  # between neighbours on the rim
    problem = start(
        disc(rings, RADIUS * np.sqrt(angle / np.sin(angle))),
        degree,
        material=material,
        bending=False,
        young_modulus=MODULUS,
        thickness=THICKNESS,
    )
    place = SCALE * problem.model.node_points / (2 * SPHERE)
    square = (place**2).sum(axis=1)[:, None]
    points = SPHERE * np.c_[2 * place, 1 - square] / (1 + square)
    problem.state[problem.model.position_dofs] = points
    return problem.model.energy(problem.state)


# -- the table -----------------------------------------------------------------------------------
def rows(full: bool = False) -> list[Row]:
    """Stresses [kPa], stretches, and energies [mN mm]."""
    result = []
    for degree in (1, 2, 3) if full else (1, 2):
        for material in MATERIALS:
            for name, gradient in _gradients().items():
                if not full and degree == 2 and name[-3:] not in ("0.8", "1.4", "0.7"):
                    continue
                exact = nominal_stress(material, gradient)
                found = strip_stress(degree, material, gradient)
                case = f"{name}, {material}, degree {degree}"
                for i, j in np.ndindex(2, 2):
                    row = (float(found[i, j]), float(exact[i, j]), 1e-9 * MODULUS)
                    source = "closed form, nominal stress"
                    result.append(Row("Homogeneous", case, f"P_{i + 1}{j + 1}", *row, source, True))
        case = f"St. Venant-Kirchhoff in compression, degree {degree}"
        row = limit_stretch(degree, "along"), 1 / np.sqrt(3), 1e-9, "1/sqrt(3)"
        result.append(Row("Homogeneous", case, "limit stretch, along only", *row))
        for kind, (target, source) in _ELLIPTICITY.items():
            refinement = 2 if degree < 3 else 1
            row = limit_stretch(degree, kind, refinement), target, 0.02 / degree, source
            result.append(Row("Homogeneous", case, f"limit stretch, {kind}", *row))
        value, target = loaded_stretch(degree, 0.99), stable_stretch(0.99)
        quantity = "stretch at 99 % of the peak"
        result.append(Row("Homogeneous", case, quantity, value, target, 1e-9, "stable root"))
    levels = {(1, 16): 5e-3, (2, 8): 1e-4}
    if full:
        levels |= {(1, 32): 1e-3, (2, 16): 6e-6, (3, 16): 2e-6}
    for material in MATERIALS:
        for (degree, rings), tolerance in levels.items():
            case = f"{material}, degree {degree}, {6 * rings**2} triangles"
            row = computed_cap_energy(material, degree, rings), cap_energy(material), tolerance
            result.append(Row("Disc on a sphere", case, "membrane energy", *row, "closed form"))
    return result


def draw(axes: Any) -> None:
    """Uniaxial nominal stress: closed form (lines) and the reactions of the strip (dots)."""
    line, places = np.linspace(0.45, 1.7, 100), np.r_[0.6:1.65:0.2]
    for material, colour in zip(MATERIALS, ("tab:blue", "tab:red"), strict=True):
        exact = [nominal_stress(material, np.diag([s, 1.0]))[0, 0] for s in line]
        found = [strip_stress(1, material, np.diag([s, 1.0]))[0, 0] for s in places]
        axes.plot(line, exact, color=colour, linewidth=1, label=material.replace("_", " "))
        axes.plot(places, found, "o", color=colour, markersize=4)
    axes.axvline(1 / np.sqrt(3), color="grey", linestyle=":", label="limit 1/√3")
    axes.set(xlabel="stretch", ylabel="nominal stress [kPa]", title="Uniaxial strip, ν = 0")
    axes.legend()
