"""Cusp surfaces as binary STL files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from avneo_fem.errors import SceneError
from avneo_fem.results.writing import written_whole

__all__ = ["read_stl", "write_stl"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def write_stl(path: str | Path, points: ArrayLike, triangles: ArrayLike, name: str = "") -> None:
    """Write a triangulated surface as binary STL in single precision.

    Parameters
    ----------
    path : str or Path
        File to write, whole or not at all.
    points : (n, 3) array
        Node positions [mm].
    triangles : (m, 3) array of int
        Corners of each triangle; counter-clockwise seen from the side of the normal.
    name : str
        Put into the 80-byte header.

    Raises
    ------
    ValueError
        For arrays of the wrong shape, indices out of range or positions that are not finite.
    """
    corners_of = np.asarray(triangles)
    positions = np.asarray(points, dtype=float)
    if positions.ndim != 2 or positions.shape[1] != 3 or not np.isfinite(positions).all():
        raise ValueError(f"points must be finite and (n, 3), got shape {positions.shape}")
    if corners_of.ndim != 2 or corners_of.shape[1] != 3 or corners_of.dtype.kind not in "iu":
        raise ValueError(f"triangles must be integers of shape (m, 3), got {corners_of.shape}")
    if corners_of.size and not 0 <= corners_of.min() <= corners_of.max() < len(positions):
        raise ValueError(f"triangles refer to nodes outside 0 … {len(positions) - 1}")

    corners = positions[corners_of]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1, keepdims=True)
    records = np.zeros(len(corners), dtype=_RECORD)
    # a triangle without area keeps the zero normal, which STL readers recompute
    records["normal"] = np.divide(normal, length, out=np.zeros_like(normal), where=length > 0.0)
    records["corners"] = corners
    # a header that begins with "solid" would be taken for the ASCII format
    header = f"binary STL, mm; {name}".encode("ascii", "replace")[:80].ljust(80)
    with written_whole(path) as temporary:
        temporary.write_bytes(header + np.array(len(corners), "<u4").tobytes() + records.tobytes())


def read_stl(path: str | Path) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points (n, 3) and triangles (m, 3) of a binary STL file; equal corners become one point.

    Raises
    ------
    SceneError
        When the file is missing or no binary STL.
    """
    try:
        data = Path(path).read_bytes()
        count = int.from_bytes(data[80:84], "little")
        records = np.frombuffer(data, dtype=_RECORD, offset=84)
        if len(records) != count:
            raise ValueError("length does not fit the number of triangles")
    except (OSError, ValueError) as error:
        raise SceneError("surface file", str(path), f"cannot be read ({error})") from None
    corners = records["corners"].reshape(-1, 3)
    points, inverse = np.unique(corners, axis=0, return_inverse=True)
    return points.astype(np.float64), inverse.reshape(-1, 3).astype(np.int64)
