"""The assembled shell: against a brute-force sum over triangles, and what it must not do."""

from __future__ import annotations

import os
import shutil
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from avneo_fem.compat import kernel_cache, ufl
from avneo_fem.equilibrium.directors import current_directors
from avneo_fem.equilibrium.shell_model import ShellModel
from avneo_fem.meshing.cusp_mesh import CuspMesh
from shell_cases import (
    Floats,
    disc,
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

VARIANTS = [
    {"material": "neo_hookean", "bending": True},
    {"material": "st_venant_kirchhoff", "bending": True},
    {"material": "neo_hookean", "bending": False},
]


def brute_force_energy(model: ShellModel, state: Floats) -> float:
    """Energy by loops over triangles and free-edge pieces, from the definitions."""
    p, mesh = model.parameters, model.mesh
    x = state[model.position_dofs]
    directors = current_directors(model, state) if p.bending else None
    total = 0.0
    for cell, (triangle, edges) in enumerate(zip(mesh.triangles, mesh.cell_edges, strict=True)):
        flat_sides = (mesh.points[triangle[1:]] - mesh.points[triangle[0]]).T
        f = (x[triangle[1:]] - x[triangle[0]]).T @ np.linalg.inv(flat_sides)
        c, area = f.T @ f, mesh.cell_areas[cell]
        if p.material == "neo_hookean":
            density = p.young_modulus / 4 * (np.trace(c) - 2 - np.log(np.linalg.det(c)))
        else:
            density = p.young_modulus / 8 * np.sum((c - np.eye(2)) ** 2)
        total += p.thickness * density * area
        if directors is None:
            continue
        normal = np.cross(f[:, 0], f[:, 1])
        normal /= np.linalg.norm(normal)
        curvature = np.zeros((2, 2))
        for corner in range(3):
            start, stop = triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]
            side = mesh.points[stop] - mesh.points[start]
            length = np.linalg.norm(side)
            outward = np.array([side[1], -side[0]]) / length
            conormal = np.cross(x[stop] - x[start], normal)
            conormal /= np.linalg.norm(conormal)
            director = directors[edges[corner]]
            theta = np.arctan2(director @ conormal, director @ normal)
            curvature += length * theta / area * np.outer(outward, outward)
        total += p.young_modulus * p.thickness**3 / 24 * np.sum(curvature**2) * area
    pieces = np.c_[mesh.free_edge[:-1], mesh.free_edge[1:]]
    lengths = np.linalg.norm(mesh.points[pieces[:, 1]] - mesh.points[pieces[:, 0]], axis=1)
    d = (x - p.plane_point) @ p.plane_normal - (mesh.points[:, 1] - p.template_level)
    for piece, length in zip(pieces, lengths, strict=True):
        for share in (0.5 - np.sqrt(1 / 12), 0.5 + np.sqrt(1 / 12)):
            here = (1 - share) * d[piece[0]] + share * d[piece[1]]
            ramp = max(1 - 2 * (here - p.free_edge_clearance) / p.free_edge_width, 0.0)
            load = p.free_edge_stiffness * mesh.area / lengths.sum()
            total += load * p.free_edge_width / 4 * ramp**2 * length / 2
    return float(total)


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("mesh", [disc(2), strip(4, 3, 2.0, 1.0)], ids=["disc", "strip"])
def test_against_brute_force(variant: dict, mesh: CuspMesh) -> None:
    """Truth: the definitions of all energies, summed triangle by triangle in NumPy."""
    parameters = {
        "young_modulus": 300.0,
        "thickness": 0.4,
        "free_edge_stiffness": 50.0,
        "free_edge_width": 0.3,
        "free_edge_clearance": 0.1,
        "plane_point": (0.1, 0.2, -0.3),
        "plane_normal": tuple(rotation(3)[0]),
        "template_level": 0.3,
    }
    model = shell(mesh, **variant, **parameters)
    state = rough(model, 1)
    assert model.energy(state) == pytest.approx(brute_force_energy(model, state), rel=1e-10)
    without = shell(mesh, **variant, **parameters | {"free_edge_stiffness": 0.0})
    without_state = rough(without, 1)
    assert abs(without.energy(without_state) - model.energy(state)) > 1e-3


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_taylor_of_the_whole(variant: dict, seed: int) -> None:
    """Truth: residual = derivative of the merit (energy less pressure work on a straight step),
    also away from the step's base; tangent = derivative of the residual."""
    model = shell(disc(2), **variant, free_edge_width=20.0)
    base, way = rough(model, seed), unit_direction(model, seed)
    for state in (base, base + 0.02 * way):
        slope = model.residual(state) @ way
        orders = taylor_orders(merit(model, base), slope, state, way)
        assert orders == pytest.approx(2, abs=0.05)
        change = model.tangent(state) @ way
        assert taylor_orders(model.residual, change, state, way) == pytest.approx(2, abs=0.05)


def test_layout_of_the_state() -> None:
    """Truth: positions and angles share out the state, one angle per edge; every edge's angle
    acts on exactly the triangles at that edge."""
    mesh = disc(2)
    model = shell(mesh, pressure=0.0, free_edge_stiffness=0.0)
    dofs = np.r_[model.position_dofs.ravel(), model.angle_dofs]
    assert model.position_dofs.shape == (len(mesh.points), 3)
    assert model.angle_dofs.shape == (len(mesh.edges),)
    np.testing.assert_array_equal(np.sort(dofs), np.arange(model.size))
    block = model.tangent(state_at(model, flat(mesh)))[model.angle_dofs][:, model.angle_dofs]
    pairs = {(e, f) for cell in mesh.cell_edges for e in cell for f in cell}
    rows, columns = (np.abs(block.toarray()) > 1e-10).nonzero()
    assert set(zip(rows, columns, strict=True)) <= pairs
    assert len(rows) > len(mesh.edges)


def test_membrane_has_no_angles() -> None:
    """Truth: without bending the state is the positions alone."""
    model = shell(disc(2), bending=False)
    assert model.size == 3 * len(model.mesh.points)
    assert len(model.angle_dofs) == 0


def test_directors_start_upright_and_are_copied() -> None:
    """Truth: a new model's directors are e_3, so its flat state is free of energy; later changes
    to the caller's array do not reach the model."""
    mesh = disc(2)
    model = shell(mesh, pressure=0.0, free_edge_stiffness=0.0)
    state = np.zeros(model.size)
    state[model.position_dofs] = flat(mesh)
    assert abs(model.energy(state)) < 1e-12
    mine = np.tile([0.0, 0.6, 0.8], (len(mesh.edges), 1))
    model.set_directors(mine)
    energy = model.energy(state)
    assert energy > 1.0
    mine[:] = [1.0, 0.0, 0.0]
    assert model.energy(state) == energy
    np.testing.assert_array_equal(model.directors[0], [0.0, 0.6, 0.8])


def test_load_scale() -> None:
    """Truth: P x area of the template; without pressure 0.05 E H sqrt(area)."""
    mesh = strip(4, 3, 2.0, 1.0)
    assert shell(mesh, bending=False, pressure=50.0).load_scale() == pytest.approx(100.0)
    model = shell(mesh, bending=False, pressure=0.0)
    given = model.parameters
    expected = 0.05 * given.young_modulus * given.thickness * np.sqrt(2.0)
    assert model.load_scale() == pytest.approx(expected)


def test_answers_do_not_share_memory() -> None:
    """Truth: a residual and a tangent stay what they were when the model moves on."""
    model = shell(disc(2), bending=False)
    first, second = rough(model, 1), rough(model, 2)
    residual, tangent = model.residual(first), model.tangent(first)
    kept = residual.copy(), tangent.toarray()
    model.residual(second)
    model.tangent(second)
    np.testing.assert_array_equal(residual, kept[0])
    np.testing.assert_array_equal(tangent.toarray(), kept[1])


def test_free_edge_must_be_mesh_edges() -> None:
    """Truth: free-edge nodes that no edge joins are refused, not skipped."""
    mesh = disc(2)
    broken = CuspMesh(
        mesh.points,
        mesh.triangles,
        mesh.suture_line,
        mesh.suture_arc_length,
        mesh.free_edge[[0, 2, 4, 6]],
    )
    with pytest.raises(RuntimeError, match="do not match"):
        shell(broken, bending=False)


def test_nothing_is_compiled_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Truth: other constants, meshes, directors and any number of UFL objects made before leave
    the kernels' signatures alone: no file is added to the kernel cache. (To a copy of it: other
    processes may be compiling.)"""
    for variant in VARIANTS:
        shell(disc(2), **variant)
    copied = tmp_path / "avneo_fem"
    shutil.copytree(kernel_cache(), copied, copy_function=os.symlink)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))

    def kernels() -> set[str]:
        return {file.name for file in kernel_cache().glob("libffcx_*")}

    digits = count(3)
    for variant in VARIANTS:
        model = shell(disc(2), **variant)
        rough(model, 1)
        before = kernels()
        assert before
        for round_ in range(12):
            # UFL sorts constants by the text of their serial numbers: put a change of the number
            # of digits at every place among the model's own
            ufl.Constant(model.domain, count=10 ** next(digits) - round_ - 1)
            ufl.Coefficient(model.space)
            other = shell(
                strip(2 + round_, 2, 2.0, 1.0),
                **variant,
                young_modulus=10.0 + round_,
                thickness=0.1,
                pressure=round_,
                free_edge_stiffness=1.0,
                free_edge_width=0.2,
                free_edge_clearance=0.3,
                plane_point=(1.0, 2.0, 3.0),
                plane_normal=(0.0, 1.0, 0.0),
                template_level=4.0,
            )
            state = rough(other, round_)
            assert np.isfinite(other.residual(state)).all()
        assert kernels() == before
