"""STL files and files that appear whole or not at all."""

from __future__ import annotations

import struct

import numpy as np
import pytest
import pyvista

from avneo_fem.results.surfaces import write_stl
from avneo_fem.results.writing import written_whole

CORNERS = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])  # outward
TETRAHEDRON = np.array([[0.0, 0.0, 0.0], [1.5, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]])


def test_vtk_reads_the_same_solid(tmp_path):
    """Truth: volume 1.5 and area of a tetrahedron, as VTK's own reader sees the file."""
    write_stl(tmp_path / "t.stl", TETRAHEDRON, CORNERS, "cusp 0")
    surface = pyvista.read(tmp_path / "t.stl")
    assert surface.n_cells == 4
    assert surface.volume == pytest.approx(1.5, rel=1e-6)
    slanted = np.linalg.norm(np.cross([-1.5, 2.0, 0.0], [-1.5, 0.0, 3.0])) / 2.0
    assert surface.area == pytest.approx(1.5 + 2.25 + 3.0 + slanted, rel=1e-6)


def test_bytes_follow_the_format(tmp_path):
    """Truth: 80 bytes not starting with "solid", count, 50 bytes each, unit outward normals."""
    write_stl(tmp_path / "t.stl", TETRAHEDRON, CORNERS, "solid cusp é" + 90 * "x")
    data = (tmp_path / "t.stl").read_bytes()
    assert len(data) == 84 + 4 * 50
    assert not data.startswith(b"solid")
    assert struct.unpack("<I", data[80:84]) == (4,)
    first = struct.unpack("<12fH", data[84:134])
    assert first[:3] == (0.0, 0.0, -1.0)
    assert first[3:12] == tuple(np.float32(TETRAHEDRON[[0, 2, 1]]).ravel())
    assert first[12] == 0
    last = np.array(struct.unpack("<3f", data[234:246]))
    np.testing.assert_allclose(last, np.array([2, 1.5, 1]) / np.sqrt(7.25), rtol=1e-6)


def test_no_triangles_and_no_area(tmp_path):
    """Truth: an empty file has 84 bytes; a triangle without area has the zero normal, not nan."""
    write_stl(tmp_path / "empty.stl", TETRAHEDRON, np.empty((0, 3), int))
    assert (tmp_path / "empty.stl").stat().st_size == 84
    write_stl(tmp_path / "flat.stl", TETRAHEDRON, [[1, 1, 2]])
    assert struct.unpack("<3f", (tmp_path / "flat.stl").read_bytes()[84:96]) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("points", "triangles", "message"),
    [
        (TETRAHEDRON[:, :2], CORNERS, "points must be finite"),
        (TETRAHEDRON * np.nan, CORNERS, "points must be finite"),
        (TETRAHEDRON, CORNERS.astype(float), "integers"),
        (TETRAHEDRON, CORNERS[:, :2], "integers"),
        (TETRAHEDRON, CORNERS + 1, "outside 0 … 3"),
        (TETRAHEDRON, CORNERS - 1, "outside 0 … 3"),
    ],
)
def test_bad_arrays_leave_no_file(tmp_path, points, triangles, message):
    """Truth: what cannot be written raises and leaves the folder as it was."""
    with pytest.raises(ValueError, match=message):
        write_stl(tmp_path / "t.stl", points, triangles)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_writer_keeps_the_old_file(tmp_path):
    """Truth: the folder's content before and after; the new name shows only after the block."""
    path = tmp_path / "report.json"
    with written_whole(path) as temporary:
        temporary.write_text("old")
        assert (temporary.parent, temporary.suffix) == (tmp_path, ".json")
        assert not path.exists()

    def write_half() -> None:
        with written_whole(path) as temporary:
            temporary.write_text("new")
            assert path.read_text() == "old"
            raise RuntimeError("half way")

    with pytest.raises(RuntimeError, match="half way"):
        write_half()
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [
        ("report.json", "old")
    ]
