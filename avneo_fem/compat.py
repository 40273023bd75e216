"""The one place that knows how the installed DOLFINx spells things.

Import DOLFINx, UFL, PETSc and MPI from here and nowhere else. Debian 12's DOLFINx 0.5.2 switches
the process to ``RTLD_GLOBAL`` and leaves it there, after which VTK and PyPI's h5py break
(design.md §4); the import below keeps the flags as they were. Debian 13's 0.9.0 is covered by
the same functions.
"""

from __future__ import annotations

import fcntl
import logging
import os
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

_set_flags: Callable[[int], None] = sys.setdlopenflags
_log_level, _log_handlers = logging.root.level, list(logging.root.handlers)
try:
    sys.setdlopenflags = lambda _flags: None  # type: ignore[assignment]
    import basix
    import petsc4py

    # PETSc's own handlers would turn a closed pipe or a Ctrl-C into an MPI abort
    petsc4py.init(["avneo", "-no_signal_handler"])
    import dolfinx
    import ufl
    from dolfinx import fem, mesh
    from dolfinx.fem import petsc as fem_petsc
    from mpi4py import MPI
    from petsc4py import PETSc
finally:
    sys.setdlopenflags = _set_flags  # type: ignore[assignment]

__all__ = [
    "MPI",
    "PETSC_ERROR",
    "PETSc",
    "assembled_matrix",
    "cell_areas",
    "cell_corners",
    "cell_dofs",
    "clear_stale_kernels",
    "compile_form",
    "create_mesh",
    "dofs_of_parts",
    "edge_dofs",
    "edge_tags",
    "edge_trace_element",
    "fem",
    "fem_petsc",
    "function_space",
    "install_abort_on_error",
    "interpolated",
    "kernel_cache",
    "lagrange_slopes",
    "match_edges",
    "match_points",
    "mixed_space",
    "scalar_element",
    "ufl",
    "vector_element",
    "vector_nodes",
    "versions",
]

# FFCx configures the root logger of every program that imports it
logging.root.setLevel(_log_level)
logging.root.handlers[:] = _log_handlers

PETSC_ERROR = PETSc.Error
_elements: Any = getattr(basix, "ufl", None)  # absent from 0.5.2, whose elements are UFL's own
_form: Any = fem.form
_JIT = {"cffi_extra_compile_args": ["-O2", "-g0"], "timeout": 600}
_JIT_KEYWORD = "jit_params" if _elements is None else "jit_options"


def kernel_cache() -> Path:
    """Folder of this project's compiled kernels."""
    root = os.environ.get("XDG_CACHE_HOME") or str(Path.home() / ".cache")
    return Path(root) / "avneo_fem"


@contextmanager
def _cache_lock(kind: int) -> Iterator[None]:
    """Hold the kernel cache: shared while compiling, alone while clearing it."""
    folder = kernel_cache()
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / ".lock").open("a") as lock:
        fcntl.flock(lock, kind)
        yield


def clear_stale_kernels() -> int:
    """Remove kernels whose compilation was killed; they would block every later run.

    Nothing is done while another process is compiling.

    Returns
    -------
    int
        Number of files removed.
    """
    removed = 0
    try:
        with _cache_lock(fcntl.LOCK_EX | fcntl.LOCK_NB):
            for source in kernel_cache().glob("*.c"):
                if not source.with_suffix(".c.cached").exists():
                    source.unlink()
                    removed += 1
    except BlockingIOError:
        return 0
    return removed


@contextmanager
def _compiling() -> Iterator[dict[str, Any]]:
    """Options for one compilation: flags, cache and lock, and no noise.

    FFCx and cffi warn on a cache miss of what they do themselves; exactly that is hidden, so that
    warnings may be errors elsewhere.
    """
    with _cache_lock(fcntl.LOCK_SH), warnings.catch_warnings():
        warnings.filterwarnings("ignore", "unclosed file .*libffcx", ResourceWarning)
        warnings.filterwarnings("ignore", "The distutils", DeprecationWarning)
        yield {_JIT_KEYWORD: {**_JIT, "cache_dir": str(kernel_cache())}}


def compile_form(form: Any) -> Any:
    """Compile a UFL form with this project's compiler flags (cached on disk by signature)."""
    with _compiling() as options:
        return _form(form, **options)


def assembled_matrix(form: Any) -> csr_matrix:
    """Matrix of a compiled bilinear form, assembled once."""
    matrix = fem_petsc.assemble_matrix(form)
    matrix.assemble()
    rows, columns, values = matrix.getValuesCSR()
    return csr_matrix((values, columns, rows), shape=matrix.size)


def create_mesh(points: NDArray[np.float64], triangles: NDArray[np.int64]) -> Any:
    """Serial DOLFINx mesh of ``points (n, 2)`` and ``triangles (m, 3)`` on this process."""
    cells = np.ascontiguousarray(triangles, dtype=np.int64)
    if _elements is not None:
        element = _elements.element("Lagrange", "triangle", 1, shape=(2,))
    else:
        cell = ufl.Cell("triangle", geometric_dimension=2)
        # FFCx gives the element this variant on the first cache miss; the signatures of later
        # forms would change in mid-run, and the next run would compile them again
        element = ufl.VectorElement("Lagrange", cell, 1, variant="equispaced")
    return mesh.create_mesh(MPI.COMM_SELF, cells, points, ufl.Mesh(element))


def match_points(coordinates: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[Any]:
    """Row of ``coordinates`` (k, 2 or 3) at each of the plane ``points`` (n, 2), as (n,) int64.

    Raises
    ------
    RuntimeError
        When a point has no row of its own within 1e-9 of their extent.
    """
    distance, rows = cKDTree(coordinates[:, :2]).query(points)
    if distance.max() > 1e-9 * np.ptp(points, axis=0).max() or len(np.unique(rows)) != len(points):
        raise RuntimeError("finite-element nodes do not match the mesh they were made from")
    return rows.astype(np.int64)


def edge_tags(domain: Any, midpoints: NDArray[np.float64], tag: int) -> Any:
    """Mesh tags that mark the edges with these ``midpoints`` (n, 2) by ``tag``.

    Raises
    ------
    RuntimeError
        When there is no edge at one of the midpoints.
    """
    chosen = np.sort(match_edges(domain, midpoints)).astype(np.int32)
    return mesh.meshtags(domain, 1, chosen, np.full(len(chosen), tag, dtype=np.int32))


def vector_element(domain: Any, family: str, dimension: int = 3, degree: int = 1) -> Any:
    """Element with vector values (``family``: "Lagrange", "DG" or "CR")."""
    if _elements is not None:
        return _elements.element(family, "triangle", degree, shape=(dimension,))
    return ufl.VectorElement(family, domain.ufl_cell(), degree, dim=dimension)


def scalar_element(domain: Any, family: str, degree: int = 1) -> Any:
    """Scalar element, or a vector-valued one that is not made of scalars."""
    if _elements is not None:
        return _elements.element(family, "triangle", degree)
    return ufl.FiniteElement(family, domain.ufl_cell(), degree)


def edge_trace_element(domain: Any, degree: int) -> Any:
    """Nedelec element whose tangential trace on an edge is any polynomial of this degree, told
    by the unknowns of that edge alone."""
    if degree == 0:
        return scalar_element(domain, "N1curl", 1)
    return scalar_element(domain, "N2curl", degree)


def function_space(domain: Any, element: Any) -> Any:
    """Function space of a UFL element."""
    make: Any = fem.functionspace if hasattr(fem, "functionspace") else fem.FunctionSpace
    with _compiling() as options:
        return make(domain, element, **options)


def mixed_space(domain: Any, elements: list[Any]) -> Any:
    """Function space of a mixed element."""
    if _elements is not None:
        return function_space(domain, _elements.mixed_element(elements))
    return function_space(domain, ufl.MixedElement(elements))


def cell_dofs(space: Any) -> NDArray[np.int64]:
    """(m, k) unknowns (blocks, for vector elements) of every cell."""
    table = space.dofmap.list
    count = space.mesh.topology.index_map(2).size_local
    return np.asarray(getattr(table, "array", table), dtype=np.int64).reshape(count, -1)


def dofs_of_parts(space: Any, parts: list[int]) -> NDArray[np.int64]:
    """Unknowns of some scalar parts of a mixed space, cell by cell, in the whole's numbering."""
    return np.concatenate([cell_dofs(space.sub(part)) for part in parts], axis=1).ravel()


def vector_nodes(space: Any, degree: int) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Unknowns (n, 3) and coordinates (n, 2) of the nodes of the first part of a mixed space.

    From degree 3 on DOLFINx 0.5.2 collapses that part with the nodes of some edges exchanged, so
    the coordinates come from an L2 projection.
    """
    domain = space.mesh
    triples = np.unique(cell_dofs(space.sub(0)).reshape(-1, 3), axis=0)
    if degree < 3:
        collapsed, numbers = space.sub(0).collapse()
        place = dict(zip(numbers[::3], collapsed.tabulate_dof_coordinates()[:, :2], strict=True))
        return triples, np.array([place[first] for first in triples[:, 0]])
    parts = zip(ufl.TestFunctions(space), ufl.TrialFunctions(space), strict=True)
    dx = ufl.Measure("dx", domain=domain, metadata={"quadrature_degree": 2 * degree})
    mass = compile_form(sum(ufl.inner(test, trial) for test, trial in parts) * dx)
    x, y = ufl.SpatialCoordinate(domain)
    right = compile_form(ufl.inner(ufl.as_vector([x, y, 0 * x]), ufl.TestFunctions(space)[0]) * dx)
    projected = splu(assembled_matrix(mass).tocsc()).solve(fem_petsc.assemble_vector(right).array_r)
    return triples, projected[triples[:, :2]]


def cell_corners(domain: Any) -> NDArray[np.float64]:
    """(m, 3, 2) corners of the triangles in DOLFINx's own order."""
    table = domain.geometry.dofmap
    nodes = np.asarray(getattr(table, "array", table)).reshape(-1, 3)
    return np.asarray(domain.geometry.x[nodes, :2])


def cell_areas(domain: Any) -> NDArray[np.float64]:
    """(m,) areas of the triangles in DOLFINx's own order."""
    a, b, c = cell_corners(domain).transpose(1, 0, 2)
    u, v = b - a, c - a
    return 0.5 * np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])


def edge_dofs(space: Any, number: int) -> NDArray[np.int64]:
    """(e, number) unknowns of each edge of a space whose first unknowns are ``number`` an edge."""
    domain = space.mesh
    domain.topology.create_entities(1)
    domain.topology.create_connectivity(2, 1)
    links = domain.topology.connectivity(2, 1).array.reshape(-1, 3)
    of_edge = np.empty((domain.topology.index_map(1).size_local, number), dtype=np.int64)
    of_edge[links.ravel()] = cell_dofs(space)[:, : 3 * number].reshape(-1, number)
    return of_edge


def match_edges(domain: Any, midpoints: NDArray[np.float64]) -> NDArray[np.int64]:
    """DOLFINx's edge at each of the ``midpoints`` (n, 2)."""
    domain.topology.create_entities(1)
    domain.topology.create_connectivity(1, 2)
    edges = np.arange(domain.topology.index_map(1).size_local, dtype=np.int32)
    return match_points(mesh.compute_midpoints(domain, 1, edges), midpoints)


def interpolated(space: Any, value: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unknowns of the interpolant of a constant vector."""
    function = fem.Function(space)
    function.interpolate(lambda x: np.tile(value[:, None], (1, x.shape[1])))
    return function.x.array.copy()


def lagrange_slopes(degree: int) -> NDArray[np.float64]:
    """(k, k, 2) reference gradients at node q (first index) of shape function j (second)."""
    kind = basix.LagrangeVariant.gll_warped  # type: ignore[attr-defined]
    element = basix.create_element(basix.ElementFamily.P, basix.CellType.triangle, degree, kind)
    return np.asarray(element.tabulate(1, element.points)[1:, :, :, 0].transpose(1, 2, 0))


def versions() -> dict[str, str]:
    """Versions of the numerical stack, for the report."""
    petsc = ".".join(str(part) for part in PETSc.Sys.getVersion())
    return {
        "python": sys.version.split()[0],
        "dolfinx": dolfinx.__version__,
        "petsc": petsc,
        "numpy": np.__version__,
    }


def install_abort_on_error() -> None:
    """Make an exception on one rank end all of them instead of leaving the others waiting."""
    if MPI.COMM_WORLD.size == 1:
        return
    previous = sys.excepthook

    def abort(kind: Any, value: Any, trace: Any) -> None:
        previous(kind, value, trace)
        sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)

    sys.excepthook = abort
