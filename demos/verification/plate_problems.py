"""The plates of ``plates.py``: discs and squares, their supports, and what is read off them.

A disc is meshed by a polygon with straight sides. *Clamped*, the polygon has the disc's area, so
that its rim is on average where the circle is, and all nodes of the rim are held. *Hinged*, its
corners lie on the circle and only the corners are held across the plane; why is told in
``plates.py`` (Babuska's paradox). In the plane all nodes of the rim are held.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from avneo_fem.equilibrium.directors import turn_directors
from avneo_fem.meshing.cusp_mesh import CuspMesh
from cell_fields import value_at
from linear_response import follower_load, respond
from meshes import disc, strip
from solving import Problem, start

__all__ = [
    "RIGIDITY",
    "SIZE",
    "THICKNESS",
    "Plate",
    "circular_plate",
    "deflections",
    "small_deflection",
    "square_plate",
]

Floats = NDArray[np.float64]

#: a, H [mm], E [kPa] of all plates: H/a = 1/50, so that strains stay below one per cent
SIZE, THICKNESS, YOUNG_MODULUS = 25.0, 0.5, 1000.0
#: D = E H^3/12 [mN mm], nu = 0
RIGIDITY = YOUNG_MODULUS * THICKNESS**3 / 12


@dataclass
class Plate:
    """A supported plate and the place in the template whose deflection is asked for."""

    problem: Problem
    centre: tuple[float, float]

    @property
    def name(self) -> str:
        """Degree and number of triangles."""
        model = self.problem.model
        return f"degree {model.parameters.degree}, {len(model.mesh.triangles)} triangles"

    def lift(self, displacements: Floats) -> float:
        """Deflection of the centre [mm] of nodal ``displacements`` (n, 3)."""
        return float(value_at(self.problem.model, displacements, self.centre)[2])


def circular_plate(degree: int, rings: int, clamped: bool, corners: bool = True) -> Plate:
    """Plate of radius ``SIZE`` with 6 rings^2 triangles whose rim cannot move.

    ``corners=False`` holds a hinged rim at every node of the polygon.
    """
    sides = 6 * rings
    angle = np.pi / sides
    radius = SIZE * (np.sqrt(2 * angle / np.sin(2 * angle)) if clamped else 1.0)
    problem = _plate(disc(rings, radius), degree)

    def rim(places: Floats, inner: float = np.cos(angle)) -> NDArray[np.bool_]:
        return np.asarray(np.hypot(*places.T) > radius * inner * (1 - 1e-9))

    problem.hold(rim, (0, 1))
    problem.hold(lambda x: rim(x, 1.0 if corners and not clamped else np.cos(angle)), (2,))
    if clamped:
        problem.clamp(rim)
    return Plate(problem, (0.0, 0.0))


def square_plate(degree: int, columns: int, clamped: bool, structured: bool = True) -> Plate:
    """Square with sides ``SIZE`` and 2 columns^2 triangles, its boundary clamped or hinged."""
    problem = _plate(strip(columns, columns, SIZE, SIZE, structured), degree)

    def rim(places: Floats) -> NDArray[np.bool_]:
        return np.asarray((np.abs(places - SIZE / 2) > SIZE / 2 * (1 - 1e-9)).any(axis=1))

    problem.hold(rim)
    if clamped:
        problem.clamp(rim)
    return Plate(problem, (SIZE / 2, SIZE / 2))


def _plate(mesh: CuspMesh, degree: int) -> Problem:
    return start(
        mesh,
        degree,
        force_scale=1.0,
        young_modulus=YOUNG_MODULUS,
        thickness=THICKNESS,
    )


def small_deflection(plate: Plate) -> tuple[float, float, float]:
    """Answer to an upward pressure q = 1 kPa by one linear solve.

    Returns
    -------
    (float, float, float)
        Deflection of the centre over q a^4/D, and the means over a circular rim of its fall over
        q a^3/D and of the moment of its clamp over q a^2.
    """
    problem, model = plate.problem, plate.problem.model
    load = follower_load(problem, -1.0)  # the pressure pushes along -n
    response = respond(problem, load)
    reaction = model.tangent(problem.state) @ response - load
    mesh = model.mesh
    edges = np.flatnonzero(mesh.edge_cells[:, 1] < 0)
    first, second = mesh.points[mesh.edges[edges, 0]], mesh.points[mesh.edges[edges, 1]]
    along = second - first
    perimeter = np.linalg.norm(along, axis=1).sum()
    sense = np.sign(first[:, 0] * along[:, 1] - first[:, 1] * along[:, 0])
    turned = turn_directors(model, np.zeros(model.size), edges, sense)
    slope = problem.edge_moment(lambda x: np.ones(len(x), dtype=bool), 1.0) @ response / perimeter
    moment = reaction @ turned / perimeter
    lift = plate.lift(response[model.position_dofs])
    return (
        lift * RIGIDITY / SIZE**4,
        float(slope) * RIGIDITY / SIZE**3,
        -float(moment) / SIZE**2,
    )


def deflections(plate: Plate, loads: Floats) -> Floats:
    """(l,) central deflection over thickness at increasing loads q a^4/(64 D H)."""
    problem, found = plate.problem, []
    for load in loads:
        pressure = float(load) * 64 * RIGIDITY * THICKNESS / SIZE**4
        problem.model.pressure = pressure
        problem.system.force_scale = pressure * problem.model.mesh.area
        problem.solve(1e-8)
        found.append(-plate.lift(problem.displacements) / THICKNESS)
    return np.array(found)
