"""What must not change an answer: where the problem is put, its mirror image, the numbering of
nodes and cusps, and the units. All to 1e-8 of the size of the problem.

m and Pa: lengths x 1e-3, moduli and pressures x 1e3, so forces (N for mN) x 1e-3.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from pydantic import BaseModel

from avneo_fem.equilibrium.directors import start_directors, turn_directors
from avneo_fem.geometry.valve_input import ValveInput
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.scene import parse_scene
from avneo_fem.stages.cusp_setup import CuspSetup
from avneo_fem.stages.record import Snapshot, StageRecord
from avneo_fem.stages.suturing import CuspSuturing
from meshes import strip
from run_cases import SMALL
from shell_cases import renumbered, rotation
from solving import start

Floats = NDArray[np.float64]

METRE = 1e-3


def scaled(mesh: CuspMesh, unit: float) -> CuspMesh:
    """The mesh in other units of length."""
    return replace(mesh, points=unit * mesh.points, suture_arc_length=unit * mesh.suture_arc_length)


def mirrored(mesh: CuspMesh, axis: int) -> CuspMesh:
    """The mesh with the sign of one coordinate turned; nodes keep their numbers."""
    length = mesh.suture_arc_length[-1]
    return CuspMesh(
        mesh.points * np.where(np.arange(2) == axis, -1.0, 1.0),
        mesh.triangles[:, [0, 2, 1]],
        mesh.suture_line[::-1].copy(),
        (length - mesh.suture_arc_length)[::-1].copy(),
        mesh.free_edge[::-1].copy(),
    )


# -- a bent plate ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Plate:
    """A plate of 8 x 6 mm under follower pressure, clamped on the left at 40 degrees, hinged on
    the right 2 mm nearer; ``side`` -1: all of it downwards."""

    mesh: CuspMesh
    turn: Floats
    shift: Floats
    unit: float = 1.0
    side: float = 1.0

    def positions(self, degree: int) -> tuple[Floats, Floats]:
        """Template coordinates (n, 2) and solution (n, 3) of all nodes, turned and shifted."""
        unit, steps = self.unit, 4
        problem = start(
            self.mesh,
            degree,
            force_scale=8.0 * 48.0 * unit,
            material="neo_hookean",
            young_modulus=1000.0 / unit,
            thickness=0.5 * unit,
        )
        model, dofs = problem.model, problem.model.position_dofs
        problem.state[dofs] = problem.positions @ self.turn.T + self.shift
        problem.state = start_directors(model, problem.state)
        x = model.node_points[:, 0] / unit
        left = lambda points: points[:, 0] < 1e-9  # noqa: E731
        right = lambda points: points[:, 0] > 8.0 * unit - 1e-9  # noqa: E731
        edges = problem.edges(left)
        sense = np.sign(np.diff(self.mesh.points[self.mesh.edges[edges]], axis=1)[:, 0, 1])
        problem.hold(left)
        problem.hold(right)
        problem.clamp(left)
        for step in range(1, steps + 1):
            turn = -self.side * np.radians(40.0) / steps * sense
            problem.state = turn_directors(model, problem.state, edges, turn)
            nearer = np.c_[-2.0 / steps * unit * x / 8.0, 0 * x, 0 * x]
            problem.state[dofs] += nearer @ self.turn.T
            model.pressure = -self.side * 8.0 / unit * step / steps
            # as far as rounding lets all of them go, moments counted alike in all units
            problem.solve(5e-12 if step == steps else 1e-6)
        return model.node_points, problem.positions


PLATE = Plate(strip(6, 5, 8.0, 6.0, structured=False), np.eye(3), np.zeros(3))
OFF, AWAY = rotation(4), np.array([30.0, -20.0, 10.0])
BACK = np.random.default_rng(3).permutation(len(PLATE.mesh.points))
#: another plate, and how its template and its solution are brought back to those of PLATE
PLATES: dict[str, tuple[Plate, Callable[[Floats], Floats], Callable[[Floats], Floats]]] = {
    "rigid motion": (
        replace(PLATE, turn=OFF, shift=AWAY),
        lambda plane: plane,
        lambda space: (space - AWAY) @ OFF,
    ),
    "mirror image in y": (
        replace(PLATE, mesh=mirrored(PLATE.mesh, 1)),
        lambda plane: plane * [1, -1],
        lambda space: space * [1, -1, 1],
    ),
    "mirror image in z": (
        replace(PLATE, side=-1.0),
        lambda plane: plane,
        lambda space: space * [1, 1, -1],
    ),
    "numbers of the nodes": (
        replace(PLATE, mesh=renumbered(PLATE.mesh, BACK)),
        lambda plane: plane,
        lambda space: space,
    ),
    "m and Pa": (
        replace(PLATE, mesh=scaled(PLATE.mesh, METRE), unit=METRE),
        lambda plane: plane / METRE,
        lambda space: space / METRE,
    ),
}


def _in_order(plane: Floats, space: Floats) -> Floats:
    """Rows of ``space`` sorted by their places in the template."""
    return space[np.lexsort(np.round(plane, 6).T)]


@pytest.fixture(scope="module", params=[1, 2])
def bent(request: pytest.FixtureRequest) -> tuple[int, Floats]:
    """Degree, and the plate's solution."""
    return request.param, _in_order(*PLATE.positions(request.param))


def test_plate_is_strongly_bent(bent: tuple[int, Floats]) -> None:
    """Truth: what is compared below is far from flat: it rises by almost five thicknesses."""
    assert bent[1][:, 2].max() > 2.4


@pytest.mark.parametrize("change", PLATES)
def test_plate(bent: tuple[int, Floats], change: str) -> None:
    """Truth: the same solution, moved, mirrored, renumbered or in other units."""
    plate, flat, back = PLATES[change]
    plane, space = plate.positions(bent[0])
    assert np.abs(_in_order(flat(plane), back(space)) - bent[1]).max() < 1e-8 * 8.0


# -- the valve's geometry ----------------------------------------------------------------------


def unequal(shape: str = "A") -> dict[str, Any]:
    """A scene of three different cusps."""
    sizes = [(30.0, 12.7), (24.0, 10.2), (27.0, 11.4)]
    cusps = [{"template": {"free_edge_length": a, "belly_radius": b}} for a, b in sizes]
    ratio = {"chord_ratio": [6.0, 4.9, 5.3]}
    return {"commissures": ratio, "suture_line": {"type": shape}, "cusp": cusps}


def reordered(data: dict[str, Any], order: list[int]) -> dict[str, Any]:
    """The scene whose cusp i is cusp ``order[i]`` of this one."""
    changed = dict(data)
    ratio = data["commissures"]["chord_ratio"]
    changed["commissures"] = data["commissures"] | {"chord_ratio": [ratio[i] for i in order]}
    if "cusp" in data:
        changed["cusp"] = [data["cusp"][i] for i in order]
    return changed


def in_metres(data: dict[str, Any]) -> dict[str, Any]:
    """The scene in m, Pa and N, by the units that the entries' descriptions name."""
    factors = {"[mm]": METRE, "[kPa]": 1 / METRE, "[mN]": METRE}

    def converted(value: Any, text: str) -> Any:
        if isinstance(value, BaseModel):
            entries = type(value).model_fields.items()
            given = {name: (getattr(value, name), info.description) for name, info in entries}
            return {k: converted(v, t or "") for k, (v, t) in given.items() if v is not None}
        if isinstance(value, tuple):
            return [converted(entry, text) for entry in value]
        units = re.findall(r"\[(?:mm|kPa|mN)\]", text)
        return value * factors[units[0]] if units else value

    changed: dict[str, Any] = converted(parse_scene(data), "")
    return changed


def about_axis(first: ValveInput, name: int) -> Floats:
    """(3, 3) turn about z that takes A_name of a valve to where A_0 is."""
    x, y, _ = first.geometry.commissures.points[name]
    radius = np.hypot(x, y)
    return np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, radius]]) / radius


def check_valves(
    one: ValveInput, two: ValveInput, order: list[int], move: Floats, wedges: bool = True
) -> None:
    """All of the geometry of ``two``: cusp i is cusp ``order[i]`` of ``one``, moved by the (3, 3)
    matrix ``move``, which may scale and mirror. ``wedges``: the contact curves too."""
    first, second, unit = one.geometry, two.geometry, abs(np.linalg.det(move)) ** (1 / 3)
    size = 1e-8 * unit * 12.0

    def same(found: Any, wanted: Any) -> None:
        np.testing.assert_allclose(found, wanted, rtol=0, atol=size)

    assert second.triple_contact.nu_star == pytest.approx(first.triple_contact.nu_star, rel=1e-8)
    assert second.competent == first.competent
    same(second.triple_contact.point, first.triple_contact.point @ move.T)
    same(second.commissures.points, first.commissures.points[order] @ move.T)
    same(second.contact_lengths, unit * first.contact_lengths[order])
    same(second.commissure_lengths, unit * first.commissure_lengths[order])
    share, turned = np.linspace(0.0, 1.0, 30), np.linalg.det(move) < 0
    probes = np.random.default_rng(1).uniform(-12.0, 12.0, (200, 3))
    for i, j in enumerate(order):
        a, b = first.cusps[j], second.cusps[i]
        line = (1 - share if turned else share) * b.template.suture_length
        start_line = share * a.template.suture_length
        same(b.sutured_position(line), a.sutured_position(start_line) @ move.T)
        # b is a cross product of two vectors of which the mirror turns one
        conormal = a.sutured_conormal(start_line) @ move.T / unit
        np.testing.assert_allclose(b.sutured_conormal(line), conormal, atol=1e-7)
        assert b.stitching.stitching_ratio == pytest.approx(a.stitching.stitching_ratio, rel=1e-8)
        for lam in (0.0, 0.4, 1.0) if wedges else (0.0,):
            distance = one.wedges.wedge(j, lam).signed_distance(probes)
            same(two.wedges.wedge(i, lam).signed_distance(probes @ move.T), unit * distance)
    if wedges:
        np.testing.assert_allclose(two.wedges.sigma, one.wedges.sigma[order], rtol=1e-8)


@pytest.mark.parametrize("shape", ["A", "B"])
@pytest.mark.parametrize("first", [1, 2])
def test_valve_renumbered(first: int, shape: str) -> None:
    """Truth: which commissure is called A_0 matters for nothing but the turn about the axis:
    nu*, sigma*, contact lengths, suture lines, conormals and distances from the wedges permute."""
    order = [(first + i) % 3 for i in range(3)]
    one = ValveInput.from_scene(parse_scene(unequal(shape)))
    two = ValveInput.from_scene(parse_scene(reordered(unequal(shape), order)))
    check_valves(one, two, order, about_axis(one, first))


def test_valve_mirrored() -> None:
    """Truth: the mirror image of a valve whose lines have no hand (type A) is the valve with cusps
    1 and 2 exchanged, straight wedges (lambda = 0) included. Contact curves have a hand: (3.3)
    bends all three the same way round."""
    one = ValveInput.from_scene(parse_scene(unequal()))
    two = ValveInput.from_scene(parse_scene(reordered(unequal(), [0, 2, 1])))
    check_valves(one, two, [0, 2, 1], np.diag([1.0, -1.0, 1.0]), wedges=False)
    probes = np.random.default_rng(1).uniform(-12.0, 12.0, (200, 3))
    there = one.wedges.wedge(0, 1.0).signed_distance(probes)
    assert np.abs(two.wedges.wedge(0, 1.0).signed_distance(probes * [1, -1, 1]) - there).max() > 0.1


@pytest.mark.parametrize("shape", ["A", "B"])
def test_valve_in_metres(shape: str) -> None:
    """Truth: lengths scale, ratios stay."""
    one = ValveInput.from_scene(parse_scene(unequal(shape)))
    two = ValveInput.from_scene(parse_scene(in_metres(unequal(shape))))
    check_valves(one, two, [0, 1, 2], METRE * np.eye(3))


# -- one cusp, sutured -------------------------------------------------------------------------


class Enough(BaseException):
    """The end of a run that has shown what it should."""


def small(order: list[int]) -> dict[str, Any]:
    """The small scene with unequal chords, solved tightly."""
    data = tomllib.loads(SMALL)
    data["commissures"] = {"chord_ratio": [1.0, 1.04, 0.97]}
    data["solver"]["tolerance"] = 1e-12
    return reordered(data, order)


def snapshots(
    data: dict[str, Any], index: int, mesh: CuspMesh | None = None, last: str = "equilibrium"
) -> tuple[ValveInput, CuspMesh, list[Snapshot]]:
    """Run the stages of one cusp up to the first level of ``last``."""
    given = ValveInput.from_scene(parse_scene(data))
    if mesh is None:
        size = given.scene.mesh_size
        mesh = triangulate_template(given.geometry.cusps[index].template, size)
    setup = CuspSetup(given.scene, given.geometry, given.wedges, index, mesh)

    def observer(_index: int, record: StageRecord) -> None:
        if record.name == last:
            raise Enough

    suturing = CuspSuturing(setup, observer)
    with pytest.raises(Enough):
        suturing.run()
    return given, mesh, suturing.snapshots


@pytest.fixture(scope="module")
def sutured() -> tuple[ValveInput, CuspMesh, list[Snapshot]]:
    """Cusp 1 of the small scene, all stages."""
    return snapshots(small([0, 1, 2]), 1)


def check_stages(shots: list[Snapshot], wanted: list[Snapshot], move: Floats) -> None:
    """The same levels, the last with the same nodes to 1e-8 of R, the others to what their looser
    tolerance leaves."""
    assert [shot.name for shot in shots] == [shot.name for shot in wanted[: len(shots)]]
    unit = abs(np.linalg.det(move)) ** (1 / 3)
    for shot, other in zip(shots, wanted, strict=False):
        last = shot is shots[-1]
        off = np.abs(shot.points - other.points @ move.T).max() / (12.0 * unit)
        assert off < (1e-8 if last else 1e-6)


def test_cusp_renumbered(sutured: tuple[ValveInput, CuspMesh, list[Snapshot]]) -> None:
    """Truth: called 0, at the place of cusp 0, cusp 1 goes through the same levels to the same
    equilibrium."""
    given, _, wanted = sutured
    _, _, shots = snapshots(small([1, 2, 0]), 0)
    assert len(shots) == len(wanted)
    check_stages(shots, wanted, about_axis(given, 1))


def test_cusp_in_metres(sutured: tuple[ValveInput, CuspMesh, list[Snapshot]]) -> None:
    """Truth: no absolute number decides anything: in m and Pa the same levels and places."""
    _, mesh, wanted = sutured
    _, _, shots = snapshots(in_metres(small([0, 1, 2])), 1, scaled(mesh, METRE))
    assert len(shots) == len(wanted)
    check_stages(shots, wanted, METRE * np.eye(3))


def test_cusp_mirrored(sutured: tuple[ValveInput, CuspMesh, list[Snapshot]]) -> None:
    """Truth: up to the straight wedge (lambda = 0) the mirrored cusp is the mirror image; after
    that the contact curves have a hand."""
    _, mesh, wanted = sutured
    _, _, shots = snapshots(small([0, 2, 1]), 2, mirrored(mesh, 0), last="contact_wedge")
    check_stages(shots, wanted, np.diag([1.0, -1.0, 1.0]))
