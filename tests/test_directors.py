"""Edge directors: mean normals, renewal, and the rotation that clamps the sutured edge."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla

from avneo_fem.equilibrium.directors import (
    clamp_rotation,
    current_directors,
    renew_directors,
    start_directors,
)
from avneo_fem.equilibrium.shell_model import ShellModel
from shell_cases import disc, flat, renumbered, rotation, rough, shell, state_at, strip


def edge_vectors(model: ShellModel, state: np.ndarray) -> np.ndarray:
    side = np.diff(state[model.position_dofs][model.mesh.edges], axis=1)[:, 0]
    return side / np.linalg.norm(side, axis=1, keepdims=True)


def test_start_directors_bisect() -> None:
    """Truth: on two half-planes meeting at 50 degrees the crease's directors bisect their
    normals, all others are the normal of their side; angles are zero."""
    mesh, angle = strip(4, 3, 2.0, 1.0, jitter=0.0), np.radians(50)
    model = shell(mesh)
    x, y = mesh.points.T
    beyond = np.maximum(x - 1, 0)
    bent = np.c_[np.minimum(x, 1) + beyond * np.cos(angle), y, beyond * np.sin(angle)]
    state = np.full(model.size, 7.0)
    state[model.position_dofs] = bent
    result = start_directors(model, state)
    np.testing.assert_array_equal(result[model.position_dofs], bent)
    np.testing.assert_array_equal(result[model.angle_dofs], 0.0)
    assert state[model.angle_dofs[0]] == 7.0
    middle = mesh.points[mesh.edges].mean(axis=1)[:, 0]
    crease = np.isclose(mesh.points[mesh.edges, 0], 1.0).all(axis=1)
    assert crease.sum() == 3
    tilt = np.where(crease, angle / 2, np.where(middle > 1, angle, 0.0))
    expected = np.c_[-np.sin(tilt), 0 * tilt, np.cos(tilt)]
    np.testing.assert_allclose(model.directors, expected, atol=1e-12)


@pytest.mark.parametrize("seed", [0, 1])
def test_unit_across_the_edge(seed: int) -> None:
    """Truth: directors are unit vectors across their edges, whatever the state."""
    model = shell(disc(3))
    state = rough(model, seed)
    for directors in (model.directors, current_directors(model, state)):
        np.testing.assert_allclose(np.linalg.norm(directors, axis=1), 1.0)
        across = np.einsum("ed,ed->e", directors, edge_vectors(model, state))
        assert np.abs(across).max() < 1e-12


def test_current_directors_turn_about_the_edge() -> None:
    """Truth: p_e turned by alpha_e about the edge (Rodrigues), smaller node to larger."""
    model = shell(disc(2))
    state = rough(model, 2)
    tangent, angle = edge_vectors(model, state), state[model.angle_dofs]
    expected = [
        r * np.cos(a) + np.cross(t, r) * np.sin(a) + t * (t @ r) * (1 - np.cos(a))
        for t, a, r in zip(tangent, angle, model.directors, strict=True)
    ]
    np.testing.assert_allclose(current_directors(model, state), expected, atol=1e-12)


def test_renewal_keeps_the_directors() -> None:
    """Truth: renewal moves the reference to the present mean normals and the angles with it: the
    current directors and the positions stay, though the surface has moved since."""
    model = shell(disc(2))
    state = rough(model, 3)
    random = np.random.default_rng(0)
    state[model.position_dofs] += 0.05 * random.normal(size=model.position_dofs.shape)
    now, before = current_directors(model, state), model.directors
    renewed = renew_directors(model, state)
    reference = model.directors
    assert np.abs(reference - before).max() > 0.05
    np.testing.assert_allclose(current_directors(model, renewed), now, atol=1e-14)
    np.testing.assert_array_equal(renewed[model.position_dofs], state[model.position_dofs])
    start_directors(model, state)
    np.testing.assert_allclose(reference, model.directors, atol=1e-14)


@pytest.mark.parametrize("turns", [-2, 1, 3])
def test_renewal_counts_turns(turns: int) -> None:
    """Truth: an angle of several turns keeps them; it changes by what the reference turned."""
    model = shell(disc(2))
    state, reference = rough(model, 3), model.directors
    state[model.position_dofs] += 0.05 * np.random.default_rng(1).normal(
        size=model.position_dofs.shape
    )
    once = renew_directors(model, state)
    assert np.abs(once - state)[model.angle_dofs].max() > 0.05
    wound = state.copy()
    wound[model.angle_dofs] += 2 * np.pi * turns
    model.set_directors(reference)
    np.testing.assert_allclose(
        renew_directors(model, wound)[model.angle_dofs],
        once[model.angle_dofs] + 2 * np.pi * turns,
        atol=1e-12,
    )


def test_folded_flat() -> None:
    """Truth: where two triangles lie on each other the mean normal vanishes; the director is one
    of the two, and finite."""
    mesh = strip(2, 1, 2.0, 1.0, jitter=0.0)
    model = shell(mesh)
    x, y = mesh.points.T
    state_at(model, np.c_[1 - np.abs(x - 1), y, 0 * x])
    crease = np.isclose(mesh.points[mesh.edges, 0], 1.0).all(axis=1)
    assert crease.sum() == 1
    np.testing.assert_allclose(np.abs(model.directors[crease]), [[0.0, 0.0, 1.0]], atol=1e-12)


def test_membrane_state_is_left_alone() -> None:
    """Truth: without bending there are no directors and the state is handed back."""
    model = shell(disc(2), bending=False)
    state = rough(model, 1)
    assert start_directors(model, state) is state
    assert renew_directors(model, state) is state


def suture_frames(model: ShellModel, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Direction of the suture line and outward conormal in the plane of a flat state."""
    line = state[model.position_dofs][model.mesh.suture_line]
    along = np.diff(line, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return along, line[:-1] - line[:-1].mean(axis=0)


@pytest.mark.parametrize("shuffled", [False, True])
@pytest.mark.parametrize("turn", [-2.5, -0.3, 0.0, 1.0, 3.0])
def test_clamp_rotation_of_a_turned_half_plane(turn: float, shuffled: bool) -> None:
    """Truth: for the conormal turned by phi about the suture line the rotation is phi (about
    the edge as stored, so -phi where that runs against the line); added to the angles it makes
    the director b x (direction of the line). The cusp leaves along -b."""
    mesh = disc(3)
    if shuffled:
        mesh = renumbered(mesh, np.random.default_rng(1).permutation(len(mesh.points)))
    model, q = shell(mesh), rotation(6)
    state = state_at(model, flat(mesh) @ q.T + 1.0)
    along, outward = suture_frames(model, state)
    normal = q[:, 2]
    conormal = np.cross(along, normal)
    assert np.einsum("kd,kd->k", conormal, outward).mean() > 0  # out of the disc indeed
    wanted = np.cos(turn) * conormal + np.sin(turn) * np.cross(along, conormal)
    answer = clamp_rotation(model, state, wanted)
    sense = np.where(np.diff(mesh.suture_line) > 0, 1.0, -1.0)
    assert (len(set(sense)) == 2) == shuffled
    np.testing.assert_allclose(answer, sense * turn, atol=1e-12)
    # a part of b along the edge changes nothing
    slanted = clamp_rotation(model, state, wanted + 0.5 * along)
    np.testing.assert_allclose(slanted, answer, atol=1e-12)
    edges = mesh.suture_edges
    state[model.angle_dofs[edges]] += answer
    now = current_directors(model, state)[edges]
    np.testing.assert_allclose(now, np.cross(wanted, along), atol=1e-12)
    np.testing.assert_allclose(clamp_rotation(model, state, wanted), 0.0, atol=1e-12)


def test_clamped_cusp_leaves_against_the_conormal() -> None:
    """Truth: a flat cusp that leaves its straight edge along -b is clamped already; turned about
    that edge by phi it needs the rotation -phi to get back."""
    mesh, turn = strip(4, 3, 2.0, 1.0), 0.7
    model = shell(mesh)
    bottom = np.flatnonzero((mesh.points[mesh.suture_line, 1] == 0)[:-1])[:4]
    b = np.tile([0.0, -1.0, 0.0], (len(mesh.suture_line) - 1, 1))
    b[: bottom[0]], b[bottom[-1] + 1 :] = [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]
    state = state_at(model, flat(mesh))
    np.testing.assert_allclose(clamp_rotation(model, state, b), 0.0, atol=1e-12)
    x, y = mesh.points.T
    raised = np.c_[x, y * np.cos(turn), y * np.sin(turn)]  # about e_1, the line's direction
    answer = clamp_rotation(model, state_at(model, raised), b)
    np.testing.assert_allclose(answer[bottom], -turn, atol=1e-12)


def test_clamped_plate_rises_towards_the_prescribed_side() -> None:
    """Truth: a plate held along one edge and clamped at slope phi is a plane tilted by phi: it
    leaves along -b, which for b = (0, -cos, -sin) is upwards."""
    mesh, slope = strip(4, 3, 2.0, 1.0), 1e-3
    model = shell(mesh, pressure=0.0, free_edge_stiffness=0.0)
    state = state_at(model, flat(mesh))
    bottom = np.flatnonzero((mesh.points[mesh.suture_line, 1] == 0)[:-1])[:4]
    b = np.tile([0.0, -np.cos(slope), -np.sin(slope)], (len(mesh.suture_line) - 1, 1))
    edges = mesh.suture_edges[bottom]
    held = np.zeros(model.size, dtype=bool)
    held[model.position_dofs[np.isclose(mesh.points[:, 1], 0.0)]] = True
    held[model.angle_dofs[edges]] = True
    move = np.zeros(model.size)
    move[model.angle_dofs[edges]] = clamp_rotation(model, state, b)[bottom]
    tangent = model.tangent(state)
    move[~held] = spla.spsolve(tangent[~held][:, ~held].tocsc(), -(tangent @ move)[~held])
    rise = move[model.position_dofs[:, 2]]
    np.testing.assert_allclose(rise, slope * mesh.points[:, 1], atol=1e-9)
