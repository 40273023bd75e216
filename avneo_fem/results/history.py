"""Every stage of a run as a time step of one XDMF file (with its HDF5 file beside it)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.results.writing import written_whole

__all__ = ["HistoryStep", "write_history"]


@dataclass(frozen=True)
class HistoryStep:
    """State of the valve after one stage.

    Parameters
    ----------
    time : float
        Time step, increasing from stage to stage (the number of the stage will do).
    name : str
        Name of the stage.
    parameter : float
        Its parameter: λ, η₁ [kPa] or the share of the boundary path.
    points : (n, 3) array
        Current node positions [mm].
    point_fields, cell_fields : mapping of str to array
        Values at nodes, (n,) or (n, 3), and in triangles, (m,) or (m, 3).
    """

    time: float
    name: str
    parameter: float
    points: NDArray[np.float64]
    point_fields: Mapping[str, ArrayLike] = field(default_factory=dict)
    cell_fields: Mapping[str, ArrayLike] = field(default_factory=dict)


def _checked_field(name: str, values: ArrayLike, count: int) -> NDArray[np.generic]:
    array = np.asarray(values)
    if array.shape not in {(count,), (count, 3)} or array.dtype.kind not in "iuf":
        raise ValueError(
            f"field {name!r} must be numbers of shape ({count},) or ({count}, 3), "
            f"got {array.dtype} of shape {array.shape}"
        )
    return array.astype(np.int32 if array.dtype.kind in "iu" else np.float64)


def _check_steps(steps: Sequence[HistoryStep]) -> None:
    if not steps:
        raise ValueError("a history needs at least one step")
    first = steps[0]
    for step in steps:
        if np.shape(step.points) != np.shape(first.points) or np.ndim(step.points) != 2:
            raise ValueError(f"step {step.name!r}: points must keep the shape (n, 3)")
        # ParaView shows a field only where every step has it
        if step.point_fields.keys() != first.point_fields.keys() or (
            step.cell_fields.keys() != first.cell_fields.keys()
        ):
            raise ValueError(f"step {step.name!r}: fields differ from those of {first.name!r}")
    if np.any(np.diff([step.time for step in steps]) <= 0.0):
        raise ValueError("the times of the steps must increase")


class _Store:
    """Puts arrays into the HDF5 file and the references to them into the XML tree."""

    def __init__(self, file: h5py.File, public_name: str) -> None:
        self.file, self.public_name = file, public_name

    def put(self, key: str, array: NDArray[np.generic]) -> None:
        self.file.create_dataset(key, data=array)

    def refer(self, parent: ElementTree.Element, key: str) -> None:
        data = self.file[key]
        item = ElementTree.SubElement(
            parent,
            "DataItem",
            Dimensions=" ".join(map(str, data.shape)),
            NumberType="Int" if data.dtype.kind == "i" else "Float",
            Precision=str(data.dtype.itemsize),
            Format="HDF",
        )
        item.text = f"{self.public_name}:/{key}"


def _add_step(
    parent: ElementTree.Element, store: _Store, group: str, step: HistoryStep, cells: int
) -> None:
    """Add one uniform grid and its arrays."""
    grid = ElementTree.SubElement(parent, "Grid", Name=step.name, GridType="Uniform")
    for name, value in (("stage", step.name), ("parameter", repr(float(step.parameter)))):
        ElementTree.SubElement(grid, "Information", Name=name, Value=value)
    ElementTree.SubElement(grid, "Time", Value=repr(float(step.time)))
    topology = ElementTree.SubElement(
        grid, "Topology", TopologyType="Triangle", NumberOfElements=str(cells)
    )
    store.refer(topology, "triangles")
    store.put(f"{group}/points", np.asarray(step.points, dtype=np.float64))
    store.refer(ElementTree.SubElement(grid, "Geometry", GeometryType="XYZ"), f"{group}/points")
    for centre, count, fields in (
        ("Node", len(step.points), step.point_fields),
        ("Cell", cells, step.cell_fields),
    ):
        for name, values in fields.items():
            key = f"{group}/{centre.lower()}/{name}"
            array = _checked_field(name, values, count)
            kind = "Scalar" if array.ndim == 1 else "Vector"
            store.put(key, array)
            store.refer(
                ElementTree.SubElement(
                    grid, "Attribute", Name=name, AttributeType=kind, Center=centre
                ),
                key,
            )


def write_history(path: str | Path, triangles: ArrayLike, steps: Sequence[HistoryStep]) -> None:
    """Write ``path`` (``….xdmf``, XDMF 3) and, beside it, the HDF5 file of the same stem.

    Each step is a grid of a temporal collection in its *current* position, so that ParaView shows
    the motion without a filter. Both files appear whole; the HDF5 file first. Its layout
    (``triangles``, ``steps/0000/points`` …) does not change when steps are appended, so an older
    XDMF file stays readable in between.

    Parameters
    ----------
    path : str or Path
        XDMF file to write.
    triangles : (m, 3) array of int
        Topology, the same for all steps.
    steps : sequence of HistoryStep
        At least one; the same fields in each, times increasing.

    Raises
    ------
    ValueError
        For arrays of the wrong shape or type and for steps that do not fit together.
    """
    path = Path(path)
    _check_steps(steps)
    topology = np.asarray(triangles)
    nodes = len(steps[0].points)
    if topology.ndim != 2 or topology.shape[1] != 3 or topology.dtype.kind not in "iu":
        raise ValueError(f"triangles must be integers of shape (m, 3), got {topology.shape}")
    if topology.size and not 0 <= topology.min() <= topology.max() < nodes:
        raise ValueError(f"triangles refer to nodes outside 0 … {nodes - 1}")
    heavy = path.with_suffix(".h5")
    root = ElementTree.Element("Xdmf", Version="3.0")
    collection = ElementTree.SubElement(
        ElementTree.SubElement(root, "Domain"),
        "Grid",
        Name="valve",
        GridType="Collection",
        CollectionType="Temporal",
    )
    with written_whole(heavy) as temporary, h5py.File(temporary, "w") as file:
        store = _Store(file, heavy.name)
        store.put("triangles", topology.astype(np.int32))
        for number, step in enumerate(steps):
            _add_step(collection, store, f"steps/{number:04d}", step, len(topology))
    ElementTree.indent(root)
    with written_whole(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
