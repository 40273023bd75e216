"""Triangulated templates against the curves they come from: nodes, angles, areas, repeatability."""

from __future__ import annotations

import hashlib
import signal
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from avneo_fem.errors import SceneError
from avneo_fem.geometry.template import CuspTemplate
from avneo_fem.meshing.cusp_mesh import CuspMesh
from avneo_fem.meshing.triangulate import triangulate_template
from avneo_fem.scene import Template
from mesh_cases import TEMPLATES, mesh_of

SIZES = (3.0, 1.4, 0.7, 0.5)


def angles(mesh: CuspMesh) -> np.ndarray:
    """All angles (m, 3) [degrees]."""
    corners = mesh.points[mesh.triangles]
    u, v = np.roll(corners, -1, axis=1) - corners, np.roll(corners, -2, axis=1) - corners
    cross = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return np.degrees(np.arctan2(cross, (u * v).sum(axis=2)))


def digest(mesh: CuspMesh) -> str:
    """Hash of all arrays, bit by bit."""
    arrays = (
        mesh.points,
        mesh.triangles,
        mesh.suture_line,
        mesh.suture_arc_length,
        mesh.free_edge,
    )
    return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("name", TEMPLATES)
def test_triangles_are_sound(name: str, size: float) -> None:
    """Truth: counter-clockwise, no angle below 15 degrees, edges near the size, no loose nodes."""
    mesh = mesh_of(name, size)
    assert mesh.cell_areas.min() > 0.0
    assert angles(mesh).min() > 15.0  # signed: a clockwise triangle has negative ones
    lengths = np.linalg.norm(np.diff(mesh.points[mesh.edges], axis=1)[:, 0], axis=1)
    assert 0.5 * size < lengths.min() < lengths.max() < 1.5 * size
    assert np.array_equal(np.unique(mesh.triangles), np.arange(len(mesh.points)))
    assert mesh.points.dtype == np.float64
    assert mesh.triangles.dtype == np.int64


@pytest.mark.parametrize("name", TEMPLATES)
def test_boundary_nodes_lie_on_the_true_curves(name: str) -> None:
    """Truth: implicit equations of Fig. 7c: circle, its tangents from the corners, two edges."""
    mesh, template = mesh_of(name, 1.4), TEMPLATES[name]
    p = template.parameters
    half, radius, corner = p.free_edge_length / 2, p.belly_radius, template.corners[1]
    nodes = mesh.points[mesh.suture_line]
    # distance from the tangent through N_1, mirrored to the left half
    reach = np.sqrt(corner @ corner - radius**2)
    turn = np.arctan2(corner[1], corner[0]) - np.arctan2(reach, radius)
    foot = radius * np.array([np.cos(turn), np.sin(turn)])
    mirrored = nodes * np.where(nodes[:, :1] < 0, [-1.0, 1.0], [1.0, 1.0])
    on_tangent = np.abs(mirrored @ foot / radius - radius)
    on_circle = np.abs(np.hypot(*nodes.T) - radius)
    below = mirrored @ np.array([-foot[1], foot[0]]) < 0
    assert np.where(below, on_circle, on_tangent).max() < 1e-12
    edge = mesh.points[mesh.free_edge]
    level = p.corner_height + p.free_edge_height * (1.0 - np.abs(edge[:, 0]) / half)
    assert np.abs(edge[:, 1] - level).max() < 1e-12
    assert nodes[0] == pytest.approx(template.corners[0], abs=1e-12)
    assert nodes[-1] == pytest.approx(template.corners[1], abs=1e-12)
    assert np.all(np.diff(edge[:, 0]) > 0)
    assert np.abs(edge - [0.0, p.corner_height + p.free_edge_height]).sum(axis=1).min() < 1e-12


@pytest.mark.parametrize("name", TEMPLATES)
def test_suture_arc_length(name: str) -> None:
    """Truth: from 0 to l_c, growing; the curve at these lengths; even within each smooth piece."""
    mesh, template = mesh_of(name, 1.4), TEMPLATES[name]
    s = mesh.suture_arc_length
    assert (s[0], s[-1]) == (0.0, template.suture_length)
    assert np.all(np.diff(s) > 0)
    nodes = template.suture_line.point(s)
    assert np.abs(mesh.points[mesh.suture_line] - nodes).max() < 1e-12
    for start, stop in zip(
        template.suture_line.breaks[:-1], template.suture_line.breaks[1:], strict=True
    ):
        pieces = np.diff(s[(s >= start) & (s <= stop)])
        assert pieces == pytest.approx([pieces.mean()] * len(pieces), rel=1e-9)
        assert 1.4 / 1.5 < pieces.mean() < 1.4 * 1.5


def test_area_converges_with_order_two() -> None:
    """Truth: R_s t + R_s^2 phi + (H_i + H_f) L_f/2; a polygon in an arc loses h^2/12 of a sector.

    Sizes divide the arc evenly, so that the order is seen without the noise of rounding.
    """
    template = TEMPLATES["experiment 1"]
    start, stop = template.suture_line.breaks[1:3]
    counts = np.array([8, 16, 32])
    meshes = [triangulate_template(template, float(stop - start) / n) for n in counts]
    missing = np.array([template.area - mesh.area for mesh in meshes])
    orders = np.log2(missing[:-1] / missing[1:])
    assert orders == pytest.approx([2.0, 2.0], abs=0.02)
    radius = template.parameters.belly_radius
    step = (stop - start) / radius / counts
    assert missing == pytest.approx(counts * radius**2 / 2 * (step - np.sin(step)), rel=1e-9)


def test_same_mesh_again_and_in_another_process() -> None:
    """Truth: equal input gives the same mesh bit by bit."""
    first = digest(triangulate_template(TEMPLATES["experiment 1"], 2.0))
    triangulate_template(TEMPLATES["high apex"], 3.0)
    assert digest(triangulate_template(TEMPLATES["experiment 1"], 2.0)) == first
    code = (
        "from test_triangulate import digest;"
        "from avneo_fem.geometry.template import CuspTemplate;"
        "from avneo_fem.meshing.triangulate import triangulate_template;"
        "from avneo_fem.scene import Template;"
        "print(digest(triangulate_template(CuspTemplate(Template()), 2.0)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
        cwd=__file__.rsplit("/", 1)[0],
    )
    assert done.stdout.strip() == first


@pytest.fixture
def interrupts() -> Iterator[list[int]]:
    """Numbers of the signals that reached our own SIGINT handler."""
    received: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, frame: received.append(number))
    yield received
    signal.signal(signal.SIGINT, before)


def test_interrupt_handler_survives(interrupts: list[int]) -> None:
    """Truth: a SIGINT after meshing reaches the handler that was set before it."""
    handler = signal.getsignal(signal.SIGINT)
    triangulate_template(TEMPLATES["experiment 1"], 3.0)
    assert signal.getsignal(signal.SIGINT) is handler  # else the signal would end the test run
    signal.raise_signal(signal.SIGINT)
    assert interrupts == [signal.SIGINT]


def test_interrupt_handler_survives_the_first_import() -> None:
    """Truth: gmsh resets SIGINT when imported; Ctrl-C must still be a KeyboardInterrupt after."""
    code = (
        "import signal;"
        "from avneo_fem.geometry.template import CuspTemplate;"
        "from avneo_fem.meshing.triangulate import triangulate_template;"
        "from avneo_fem.scene import Template;"
        "triangulate_template(CuspTemplate(Template()), 3.0);"
        "assert signal.getsignal(signal.SIGINT) is signal.default_int_handler"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@pytest.mark.parametrize("name", TEMPLATES)
def test_size_too_large(name: str) -> None:
    """Truth: a suture line needs six pieces; the advised size gives a sound mesh."""
    with pytest.raises(SceneError, match="too large") as caught:
        triangulate_template(TEMPLATES[name], 40.0)
    assert (caught.value.key, caught.value.value) == ("mesh.size", 40.0)
    advised = float(caught.value.valid.rsplit("at most ", 1)[1].split()[0])
    mesh = triangulate_template(TEMPLATES[name], advised)
    assert len(mesh.suture_line) >= 7
    assert mesh.cell_areas.min() > 0.0


def test_small_template_at_a_small_size() -> None:
    """Truth: template and size scaled alike have the same boundary polygon, but for its scale."""
    small = {
        "free_edge_length": 39.0 / 8,
        "free_edge_height": 2.5 / 8,
        "corner_height": 11.5 / 8,
        "belly_radius": 16.5 / 8,
    }
    mesh = triangulate_template(CuspTemplate(Template(**small)), 2.0 / 8)
    large = mesh_of("experiment 1", 2.0)
    assert mesh.area == pytest.approx(large.area / 64, rel=1e-12)
    assert len(mesh.suture_line) == len(large.suture_line)
    assert angles(mesh).min() > 15.0


def test_nodes_where_they_are_wanted() -> None:
    """Truth: joints are nodes of the suture line, at their arc lengths exactly, and every piece
    between joints is divided evenly; a joint closer than h/2 to another break is left out."""
    outline = CuspTemplate(Template())
    length = float(outline.suture_line.breaks[-1])
    joints = np.array([2.5, length - 2.5])
    mesh = triangulate_template(outline, 1.4, joints)
    assert np.isin(joints, mesh.suture_arc_length).all()
    first = np.diff(mesh.suture_arc_length[mesh.suture_arc_length <= 2.5])
    np.testing.assert_allclose(first, 1.25)
    near = triangulate_template(outline, 1.4, np.array([0.6, length - 0.6]))
    assert digest(near) == digest(triangulate_template(outline, 1.4))
