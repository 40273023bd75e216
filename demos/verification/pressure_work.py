"""The follower pressure: tubes that it inflates, and the volume its work sweeps.

*Tubes.* A strip (pi/2) R_0 by 4 mm, R_0 = 10 mm, H = 0.5 mm, E = 1000 kPa, nu = 0, is rolled into
a quarter of a tube without stress and inflated from within; its straight edges slide in the two
planes of symmetry. With lambda = r/R_0 and nominal stress P(lambda), equilibrium of half a tube is

    q R_0 lambda lambda_z = H P(lambda),    P = E (lambda^3 - lambda)/2 or E (lambda - 1/lambda)/2,

with lambda_z = 1 both where the ends slide in fixed planes and where they are free (nu = 0).
Hence lambda^2 = 1 + 2 q R_0/(E H) for St. Venant-Kirchhoff and 1/(1 - 2 q R_0/(E H)) for
neo-Hookean, which no pressure above E H/(2 R_0) leaves in equilibrium. A *closed* tube also
carries the pressure on its end caps, H P(lambda_z) = q r^2/(2 R_0): the two laws, solved for a
chosen lambda, give q and lambda_z; the caps are a dead load at the end.

A tube without axial stress is delicate. Against bulges it is stable while (H P'(lambda)/R_0 - q) E
H/R_0 > q^2 lambda^2, which means lambda < sqrt(3) for both materials, but from about 1.5 on a
bulged equilibrium is found beside the cylinder: linear triangles are rough enough to fall into it,
and so is Newton's iteration from far away. A free rim curls from between 1.2 and 1.3 on (there the
tangent of the exact state has a negative eigenvalue, its vector at the rim). So free ends are
taken to 1.1, fixed ones to 1.3 and, neo-Hookean with curved triangles, to 1.6, and the start is
2 % thinner than the solution. Closed tubes are stable as far as they are taken, 1.6.

*Work.* On the straight way from one surface x to another y the pressure's work is -q times the
volume swept, counted with sign. By the divergence theorem this is a third of the flux of the
position through the closed surface of y, x reversed, and the ruled band between their rims:

    V = 1/3 [int y.(y_1 x y_2) - int x.(x_1 x x_2) + oint int_0^1 p.(p_t x p_s) ds dt],

p = (1 - s) x + s y on the boundary, run counter-clockwise. Computed here from the polynomials in
the cells and Gauss points of a high degree, without the finite-element library, it must equal the
work of random motions as large as the surface itself to rounding, rims held or not; and the
pressure's force times any motion must be the derivative of the work.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from avneo_fem.equilibrium.shell_model import ShellModel
from cell_fields import sampled
from meshes import disc, strip
from record import Row
from solving import start

__all__ = ["MATERIALS", "Tube", "draw", "inflated_tube", "rows", "swept_volume", "tube"]

Floats = NDArray[np.float64]
RADIUS, LENGTH, THICKNESS, MODULUS = 10.0, 4.0, 0.5, 1000.0  # mm, mm, mm, kPa
MATERIALS = ("st_venant_kirchhoff", "neo_hookean")
_UP_TO = {  # largest hoop stretch by ends and material; see the docstring
    ("fixed", MATERIALS[0]): 1.3,
    ("fixed", MATERIALS[1]): 1.6,
    ("free", MATERIALS[0]): 1.1,
    ("free", MATERIALS[1]): 1.1,
    ("closed", MATERIALS[0]): 1.6,
    ("closed", MATERIALS[1]): 1.6,
}
_STRIP = np.pi / 2 * RADIUS


# -- tubes ---------------------------------------------------------------------------------------
def _nominal(material: str, stretch: float) -> float:
    """P/E of a principal stretch."""
    return (stretch**3 - stretch) / 2 if material == MATERIALS[0] else (stretch - 1 / stretch) / 2


@dataclass(frozen=True)
class Tube:
    """A tube in equilibrium: pressure q R_0/(E H), hoop stretch, axial stretch."""

    pressure: float
    hoop: float
    axial: float


def tube(material: str, ends: str, hoop: float) -> Tube:
    """Closed form for a tube blown up to this hoop stretch."""
    force = _nominal(material, hoop)
    if ends != "closed":
        return Tube(force / hoop, hoop, 1.0)
    # q R_0/(E H) = P(hoop)/(hoop axial) and 2 P(axial)/hoop^2
    axial = brentq(
        lambda s: 2 * _nominal(material, s) * s - force * hoop, 1.0, 10 * hoop, xtol=1e-15
    )
    return Tube(force / (hoop * axial), hoop, axial)


def inflated_tube(columns: int, degree: int, material: str, ends: str, exact: Tube) -> Floats:
    """A quarter of a tube of ``columns``^2/2 triangles under the pressure of ``exact``.

    Returns
    -------
    (3,) array
        Mean hoop and axial stretch; largest deviation of a node's radius from the mean, over R_0.
    """
    unit = MODULUS * THICKNESS / RADIUS
    problem = start(
        strip(columns, columns // 4, _STRIP, LENGTH, structured=False),
        degree,
        force_scale=exact.pressure * unit * _STRIP * LENGTH,
        material=material,
        bending=False,
        young_modulus=MODULUS,
        thickness=THICKNESS,
    )
    model = problem.model
    angle, along = model.node_points[:, 0] / RADIUS, model.node_points[:, 1]
    rolled = 0.98 * exact.hoop * RADIUS * np.c_[np.sin(angle), 0 * angle, np.cos(angle)]
    problem.state[model.position_dofs] = rolled + np.c_[0 * along, along, 0 * along]
    problem.hold(lambda x: x[:, 0] < 1e-9, (0,))
    problem.hold(lambda x: x[:, 0] > _STRIP - 1e-9, (2,))
    problem.hold(lambda x: x[:, 1] < 1e-9, (1,))

    def far(places: Floats) -> NDArray[np.bool_]:
        return places[:, 1] > LENGTH - 1e-9

    if ends == "fixed":
        problem.hold(far, (1,))
    if ends == "closed":
        cap = MODULUS * THICKNESS * _nominal(material, exact.axial)
        problem.system.dead_load = cap * problem.edge_load(far, np.array([0.0, 1.0, 0.0]))
    model.pressure = -exact.pressure * unit  # the normal e_1 x e_2 points outwards
    problem.solve(1e-10)
    radius = np.linalg.norm(problem.positions[:, [0, 2]], axis=1) / RADIUS
    axial = problem.positions[problem.nodes(far), 1].mean() / LENGTH
    return np.array([radius.mean(), axial, np.abs(radius - radius.mean()).max()])


# -- work ----------------------------------------------------------------------------------------
def _flux(model: ShellModel, points: Floats) -> float:
    """Flux of the position through a surface with nodes at ``points`` (n, 3)."""
    samples = sampled(model, points)
    tangents = samples.gradients[..., 0], samples.gradients[..., 1]
    density = np.einsum("mqd,mqd->mq", samples.values, np.cross(*tangents))
    return float((samples.weights * density).sum())


def _band_flux(model: ShellModel, first: Floats, last: Floats) -> float:
    """Flux of the position through the ruled band between the rims of two surfaces."""
    mesh, degree = model.mesh, model.parameters.degree
    rim = np.r_[mesh.suture_line, mesh.free_edge[::-1][1:]]  # counter-clockwise, closed
    place, weight = np.polynomial.legendre.leggauss(8)
    place, weight = (place + 1) / 2, weight / 2
    total = 0.0
    for tail, head in zip(mesh.points[rim[:-1]], mesh.points[rim[1:]], strict=True):
        way, away = head - tail, model.node_points - tail
        share = away @ way / (way @ way)
        on = np.linalg.norm(away - share[:, None] * way, axis=1) < 1e-9
        nodes = np.flatnonzero(on & (share > -1e-9) & (share < 1 + 1e-9))
        inverse = np.linalg.inv(np.vander(share[nodes], degree + 1, increasing=True))
        powers = np.vander(place, degree + 1, increasing=True)
        slopes = np.c_[0 * place, powers[:, :-1] * np.arange(1, degree + 1)]
        x, y = (powers @ inverse @ points[nodes] for points in (first, last))
        x_t, y_t = (slopes @ inverse @ points[nodes] for points in (first, last))
        for s, part in zip(place, weight, strict=True):
            p, p_t = (1 - s) * x + s * y, (1 - s) * x_t + s * y_t
            total += part * weight @ np.einsum("qd,qd->q", p, np.cross(p_t, y - x))
    return float(total)


def swept_volume(model: ShellModel, first: Floats, last: Floats) -> float:
    """Signed volume [mm^3] between two surfaces with nodes at ``first`` and ``last`` (n, 3)."""
    flux = _flux(model, last) - _flux(model, first) + _band_flux(model, first, last)
    return flux / 3


def _random_motion(degree: int, held: bool) -> tuple[ShellModel, Floats, Floats]:
    """A disc, and two random states of it, with one rim if ``held``."""
    problem = start(disc(3, RADIUS), degree, bending=False, pressure=8.0, young_modulus=0.0)
    model, random = problem.model, np.random.default_rng(degree)
    first = problem.state + RADIUS * random.uniform(-0.5, 0.5, model.size)
    last = first + RADIUS * random.uniform(-1, 1, model.size)
    if held:
        apothem = RADIUS * np.cos(np.pi / 18)
        angle = np.arctan2(*model.node_points.T[::-1]) % (np.pi / 9) - np.pi / 18
        rim = np.linalg.norm(model.node_points, axis=1) * np.cos(angle) > apothem - 1e-6
        last[model.position_dofs[rim]] = first[model.position_dofs[rim]]
    return model, first, last


def _work_rows(degree: int) -> list[Row]:
    result = []
    for held in (True, False):
        model, first, last = _random_motion(degree, held)
        points = first[model.position_dofs], last[model.position_dofs]
        case = f"degree {degree}, rim {'held' if held else 'free'}"
        work = model.pressure_work(last, first)
        row = work, -model.pressure * swept_volume(model, *points), 1e-12, "divergence theorem"
        result.append(Row("Pressure", case, "work [mN mm]", *row))
        way = last - first
        # work is cubic along the way: differences of this order are exact
        one, two = (
            model.pressure_work(first + k * way, first)
            - model.pressure_work(first - k * way, first)
            for k in (1, 2)
        )
        row = float(-model.residual(first) @ way), (8 * one - two) / 12, 1e-11, "slope of the work"
        result.append(Row("Pressure", case, "force x way [mN mm]", *row))
    return result


# -- the table -----------------------------------------------------------------------------------
def rows(full: bool = False) -> list[Row]:
    """Stretches of inflated tubes, and work [mN mm]."""
    result = []
    levels = {(1, 16): (5e-4, 6e-3), (2, 16): (2e-5, 1e-4)}  # stretches, roundness
    if full:
        levels |= {(1, 64): (1e-4, 2.5e-3), (2, 32): (3e-6, 3e-5), (3, 16): (2e-8, 2e-6)}
    for (degree, columns), (tolerance, roughness) in levels.items():
        for (ends, material), most in _UP_TO.items():
            for hoop in (1.1, 1.3, 1.6) if full else (most,):
                if hoop > most or (degree == 1 and ends == "fixed" and hoop > 1.3):
                    continue
                exact = tube(material, ends, hoop)
                found = inflated_tube(columns, degree, material, ends, exact)
                case = f"{material}, {ends} ends, degree {degree}, {columns**2 // 2} triangles"
                case += f", q R_0/(E H) = {exact.pressure:.4f}"
                targets = {"hoop stretch": exact.hoop, "axial stretch": exact.axial}
                for value, (quantity, target) in zip(found[:2], targets.items(), strict=True):
                    row = float(value), target, tolerance, "equilibrium of half a tube"
                    result.append(Row("Tube", case, quantity, *row))
                row = float(found[2]), 0.0, roughness, "a round tube", True
                result.append(Row("Tube", case, "deviation from round", *row))
    for degree in (1, 2, 3) if full else (1, 2):
        result += _work_rows(degree)
    return result


def draw(axes: Any) -> None:
    """Inflation of a tube: closed form (lines) and 32 quadratic triangles (dots)."""
    line, steps = np.linspace(1.0, 1.7, 50), np.r_[1.1:1.65:0.25]
    unit = MODULUS * THICKNESS / RADIUS
    for material, colour in zip(MATERIALS, ("tab:blue", "tab:red"), strict=True):
        for ends, style in (("fixed", "-"), ("closed", "--")):
            pressure = [unit * tube(material, ends, hoop).pressure for hoop in line]
            label = f"{material.replace('_', ' ')}, {ends} ends"
            axes.plot(line, pressure, style, color=colour, linewidth=1, label=label)
            places = steps[steps < _UP_TO[ends, material] + 1e-9]
            exact = [tube(material, ends, hoop) for hoop in places]
            found = [inflated_tube(8, 2, material, ends, target)[0] for target in exact]
            reached = [unit * target.pressure for target in exact]
            axes.plot(found, reached, "o", color=colour, markersize=4)
    axes.set(xlabel="hoop stretch", ylabel="pressure [kPa]", title="Inflated tubes")
    axes.legend()
