"""Step 1 of paper §3.2: the listed properties on the three experiments; piercing by brute force."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.stages.placement import pierces, place_template
from valve_cases import experiment

SHEET = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
HALVES = np.array([[0, 1, 2], [0, 2, 3]])
CHORD = (np.array([-1.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0]))


def place_sheet(curve: np.ndarray, **constants: float) -> tuple[np.ndarray, int]:
    """The square [-1, 1]^2 hung upright at y = (c0 + c1 k) 2 from a chord on the x axis."""
    apex, up = np.array([0.0, 5.0, 0.0]), np.array([0.0, 0.0, 1.0])
    return place_template(SHEET, HALVES, 1.0, CHORD, apex, up, 2.0, curve, **constants)


@pytest.mark.parametrize("index", [0, 1, 2])
@pytest.mark.parametrize("number", [1, 2, 3])
def test_properties_of_step_1(number: int, index: int) -> None:
    """Truth: the four conditions of paper §3.2, step 1, and lengths that do not change."""
    valve = experiment(number, "code")
    cusp, plane = valve.cusps[index], valve.commissures
    mesh = triangulate_template(cusp.template, 3.0)
    first, second = plane.points[(index + 1) % 3], plane.points[(index + 2) % 3]
    line = cusp.suture_line.point(np.linspace(0.0, cusp.suture_line.length, 200))
    level = float(cusp.template.corners[0, 1])
    placed, k = place_template(
        mesh.points,
        mesh.triangles,
        level,
        (first, second),
        plane.points[index],
        plane.normal,
        plane.circumradius,
        line,
    )
    n_0, n_1 = placed[mesh.suture_line[[0, -1]]]
    # N_0 N_1 in the plane M, parallel to the chord, N_0 the nearer to A_(i+1)
    heights = (placed - plane.origin) @ plane.normal
    assert np.abs(heights[mesh.suture_line[[0, -1]]]).max() < 1e-12
    assert np.linalg.norm(np.cross(n_1 - n_0, second - first)) < 1e-10
    assert np.linalg.norm(n_0 - first) < np.linalg.norm(n_1 - first)
    # LK orthogonal to it, towards A_i
    off = (n_0 + n_1) / 2 - (first + second) / 2
    assert abs(off @ (n_1 - n_0)) < 1e-10
    assert off @ (plane.points[index] - first) > 0
    # the template's plane is orthogonal to M
    across = np.cross(n_1 - n_0, placed[mesh.suture_line[len(mesh.suture_line) // 2]] - n_0)
    assert abs(across @ plane.normal) / np.linalg.norm(across) < 1e-12
    assert np.linalg.norm((placed - n_0) @ across) < 1e-9 * np.linalg.norm(across)
    # both suture lines in the same half-space of M
    assert heights[mesh.suture_line[1:-1]].max() < 0
    assert ((line[1:-1] - plane.origin) @ plane.normal).max() < 0
    # |LK| = (c0 + c1 k) R; on a cylinder the line lies beyond the chord, so k = 0
    assert k == 0
    assert np.linalg.norm(off) == pytest.approx(plane.circumradius, rel=1e-12)
    # an isometry: all edges keep their lengths
    flat, lifted = mesh.points[mesh.edges], placed[mesh.edges]
    assert np.linalg.norm(lifted[:, 1] - lifted[:, 0], axis=1) == pytest.approx(
        np.linalg.norm(flat[:, 1] - flat[:, 0], axis=1), rel=1e-12
    )


@pytest.mark.parametrize(
    ("reach", "constants", "expected"),
    [
        (1.7, {}, 0),
        (2.05, {}, 1),
        (2.55, {}, 3),
        (1.05, {"c0": 0.0, "c1": 0.25}, 3),
        (4.5, {"c0": 0.5, "c1": 0.5}, 4),
    ],
)
def test_smallest_k(reach: float, constants: dict[str, float], expected: int) -> None:
    """Truth: a line from y = -1 to ``reach`` through the sheet: smallest k with (c0 + c1 k) 2 > it.

    The sheet hangs at y = (c0 + c1 k) R with R = 2 and covers -2 <= z <= 0.
    """
    line = np.array([[0.3, -1.0, -0.5], [0.3, reach, -0.5]])
    placed, k = place_sheet(line, **constants)
    assert k == expected
    c0, c1 = constants.get("c0", 1.0), constants.get("c1", 0.1)
    assert placed[:, 1] == pytest.approx([(c0 + c1 * k) * 2.0] * 4, rel=1e-14)
    assert (placed[:, 2].min(), placed[:, 2].max()) == (-2.0, 0.0)
    assert pierces(line, placed[HALVES] - [0.0, 2.0 * c1, 0.0]) == (k > 0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_it_stands_off_towards_the_third_commissure(side: float) -> None:
    """Truth: (LK, A_(i+1)A_i) > 0 on whichever side of the chord A_i lies."""
    apex, up = np.array([0.3, 5.0 * side, 0.0]), np.array([0.0, 0.0, 1.0])
    far = np.array([[9.0, 9.0, 9.0], [9.0, 9.0, 10.0]])
    placed, k = place_template(SHEET, HALVES, 1.0, CHORD, apex, up, 2.0, far)
    assert k == 0
    assert placed.tolist() == [[x, 2.0 * side, z - 1.0] for x, z in SHEET.tolist()]


def test_no_distance_will_do() -> None:
    """Truth: a line longer than 200 steps is an error that names the step."""
    line = np.array([[0.3, -1.0, -0.5], [0.3, 50.0, -0.5]])
    with pytest.raises(SceneError, match="larger") as caught:
        place_sheet(line, c1=0.01)
    assert (caught.value.key, caught.value.value) == ("placement.c1", 0.01)


def brute_pierces(curve: np.ndarray, corners: np.ndarray) -> bool:
    """Solve start + t (end - start) = a + u (b - a) + v (c - a) for every pair."""
    for start, end in pairwise(curve):
        for a, b, c in corners:
            t, u, v = np.linalg.solve(np.column_stack([start - end, b - a, c - a]), start - a)
            if 0 <= t <= 1 and u >= 0 and v >= 0 and u + v <= 1:
                return True
    return False


def test_pierces_by_brute_force() -> None:
    """Truth: a 3 x 3 linear system for each pair of piece and triangle, on random ones."""
    rng = np.random.default_rng(2)
    answers = []
    for _ in range(300):
        curve = np.cumsum(rng.normal(scale=0.5, size=(5, 3)), axis=0)
        corners = rng.normal(scale=0.5, size=(4, 1, 3)) + rng.normal(size=(4, 3, 3))
        answers.append(pierces(curve, corners))
        assert answers[-1] == brute_pierces(curve, corners)
        assert pierces(curve[::-1], corners[:, ::-1]) == answers[-1]
    assert 60 < sum(answers) < 240


def test_pierces_at_seams() -> None:
    """Truth: a line through a shared edge or vertex of two triangles does not slip through."""
    rng = np.random.default_rng(4)
    for _ in range(200):
        turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        shift, share = rng.normal(size=3), rng.choice([0.0, 1.0, rng.uniform()])
        sheet = np.column_stack([SHEET, np.zeros(4)])
        place = (1 - share) * sheet[0] + share * sheet[2]
        lean = np.array([0.1, 0.2, 1.0])
        line = np.array([place - lean, place + lean])
        assert pierces(line @ turn + shift, (sheet @ turn + shift)[HALVES])


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ([[-2.0, 0.2, 0.0], [2.0, 0.3, 0.0]], True),  # through, both ends outside
        ([[-2.0, 0.2, 0.0], [0.0, 0.3, 0.0]], True),  # into
        ([[-0.2, 0.2, 0.0], [0.2, 0.3, 0.0]], True),  # inside
        ([[-2.0, 1.5, 0.0], [2.0, 1.5, 0.0]], False),  # past a side
        ([[-3.0, 0.0, 0.0], [0.0, 3.0, 0.0]], False),  # past a corner
        ([[-2.0, 1.0, 0.0], [2.0, 1.0, 0.0]], True),  # along a side
        ([[-2.0, 0.2, 0.1], [2.0, 0.3, 0.1]], False),  # parallel above
        ([[0.1, 0.2, 0.0], [0.1, 0.2, 1.0]], True),  # ends on it
    ],
)
def test_pierces_in_the_plane(line: list[list[float]], expected: bool) -> None:
    """Truth: lines in or parallel to the plane of the square [-1, 1]^2, drawn by hand."""
    sheet = np.column_stack([SHEET, np.zeros(4)])[HALVES]
    assert pierces(np.array(line), sheet) == expected
    assert pierces(np.array(line)[::-1], sheet) == expected
