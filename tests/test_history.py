"""The XDMF history, read back by VTK's reader and by h5py."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import h5py
import numpy as np
import pytest
import pyvista

from avneo_fem.results.history import HistoryStep, write_history

POINTS = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.25], [0.0, 1.0, 1.0 / 3.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def step(number: int) -> HistoryStep:
    """Stage ``number``, everything in it different from the other stages."""
    return HistoryStep(
        time=1.5 * number,
        name=f"wedge λ < {number} & on",
        parameter=0.1 * number,
        points=POINTS + number,
        point_fields={
            "displacement": POINTS + 0.5 * number,
            "wall_distance": np.arange(4.0) * number,
        },
        cell_fields={"cusp": np.array([0, 2]), "principal_stress_1": [1.0 / 7.0, -number]},
    )


def test_vtk_reads_every_stage(tmp_path, monkeypatch):
    """Truth: the arrays written, bit for bit, as VTK's XDMF reader finds them for each time.

    Relative names in the file are relative to it, so the current folder must not matter.
    """
    steps = [step(number) for number in range(3)]
    write_history(tmp_path / "valve.xdmf", TRIANGLES, steps)
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    reader = pyvista.XdmfReader(str(tmp_path / "valve.xdmf"))
    assert reader.time_values == [0.0, 1.5, 3.0]
    for written in steps:
        reader.set_active_time_value(written.time)
        found = reader.read()
        np.testing.assert_array_equal(found.points, written.points)
        np.testing.assert_array_equal(found.cells.reshape(-1, 4)[:, 1:], TRIANGLES)
        assert set(found.celltypes) == {pyvista.CellType.TRIANGLE}
        assert set(found.point_data) == set(written.point_fields)
        assert set(found.cell_data) == set(written.cell_fields)
        for name, values in written.point_fields.items():
            np.testing.assert_array_equal(found.point_data[name], values)
        for name, values in written.cell_fields.items():
            np.testing.assert_array_equal(found.cell_data[name], values)


def test_stage_names_and_parameters(tmp_path):
    """Truth: what was written, through an XML parser; special characters survive."""
    write_history(tmp_path / "valve.xdmf", TRIANGLES, [step(0), step(1)])
    root = ElementTree.parse(tmp_path / "valve.xdmf").getroot()
    assert root.attrib["Version"] == "3.0"
    grids = root.findall("./Domain/Grid[@CollectionType='Temporal']/Grid")
    assert [grid.attrib["Name"] for grid in grids] == ["wedge λ < 0 & on", "wedge λ < 1 & on"]
    for number, grid in enumerate(grids):
        notes = {note.attrib["Name"]: note.attrib["Value"] for note in grid.iter("Information")}
        assert notes == {"stage": f"wedge λ < {number} & on", "parameter": repr(0.1 * number)}


def test_references_stay_valid_when_steps_are_appended(tmp_path):
    """Truth: an older XDMF file still finds its data in the newer HDF5 file."""
    write_history(tmp_path / "valve.xdmf", TRIANGLES, [step(0), step(1)])
    older = (tmp_path / "valve.xdmf").read_text(encoding="utf-8")
    write_history(tmp_path / "valve.xdmf", TRIANGLES, [step(0), step(1), step(2)])
    items = list(ElementTree.fromstring(older).iter("DataItem"))
    assert len(items) == 2 * (1 + 1 + 4)
    with h5py.File(tmp_path / "valve.h5") as file:
        for item in items:
            name, key = item.text.split(":/")
            assert name == "valve.h5"
            assert " ".join(map(str, file[key].shape)) == item.attrib["Dimensions"]
        np.testing.assert_array_equal(file["steps/0002/points"], POINTS + 2)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["valve.h5", "valve.xdmf"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": POINTS[:3]}, "keep the shape"),
        ({"point_fields": {"displacement": POINTS}}, "fields differ"),
        ({"time": 0.0}, "increase"),
        ({"cell_fields": {"cusp": [0, 1], "principal_stress_1": [1.0]}}, "principal_stress_1"),
        ({"cell_fields": {"cusp": ["a", "b"], "principal_stress_1": [1.0, 2.0]}}, "cusp"),
    ],
)
def test_steps_that_do_not_fit_leave_the_old_files(tmp_path, change, message):
    """Truth: the bytes of both files before and after the failed attempt."""
    write_history(tmp_path / "valve.xdmf", TRIANGLES, [step(0)])
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(ValueError, match=message):
        write_history(tmp_path / "valve.xdmf", TRIANGLES, [step(0), replace(step(1), **change)])
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_topology_is_checked(tmp_path):
    """Truth: no steps, quadrilaterals and indices out of range are not a history."""
    for triangles, steps, message in (
        (TRIANGLES, [], "at least one"),
        (np.array([[0, 1, 2, 3]]), [step(0)], "integers"),
        (TRIANGLES + 1, [step(0)], "outside 0 … 3"),
    ):
        with pytest.raises(ValueError, match=message):
            write_history(tmp_path / "valve.xdmf", triangles, steps)
    assert list(tmp_path.iterdir()) == []
