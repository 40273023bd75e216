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
    "clear_stale_kernels",
    "compile_form",
    "create_mesh",
    "edge_tags",
    "fem",
    "fem_petsc",
    "function_space",
    "install_abort_on_error",
    "kernel_cache",
    "match_points",
    "mixed_space",
    "scalar_element",
    "ufl",
    "vector_element",
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
        When a point has no row of its own within 1e-8 mm.
    """
    distance, rows = cKDTree(coordinates[:, :2]).query(points)
    if distance.max() > 1e-8 or len(np.unique(rows)) != len(points):
        raise RuntimeError("finite-element nodes do not match the mesh they were made from")
    return rows.astype(np.int64)


def edge_tags(domain: Any, midpoints: NDArray[np.float64], tag: int) -> Any:
    """Mesh tags that mark the edges with these ``midpoints`` (n, 2) by ``tag``.

    Raises
    ------
    RuntimeError
        When there is no edge at one of the midpoints.
    """
    domain.topology.create_entities(1)
    domain.topology.create_connectivity(1, 2)
    edges = np.arange(domain.topology.index_map(1).size_local, dtype=np.int32)
    chosen = np.sort(edges[match_points(mesh.compute_midpoints(domain, 1, edges), midpoints)])
    return mesh.meshtags(domain, 1, chosen, np.full(len(chosen), tag, dtype=np.int32))


def vector_element(domain: Any, family: str, dimension: int = 3) -> Any:
    """Lowest-order element with vector values (``family``: "Lagrange" or "CR")."""
    if _elements is not None:
        return _elements.element(family, "triangle", 1, shape=(dimension,))
    return ufl.VectorElement(family, domain.ufl_cell(), 1, dim=dimension)


def scalar_element(domain: Any, family: str) -> Any:
    """Lowest-order scalar element."""
    if _elements is not None:
        return _elements.element(family, "triangle", 1)
    return ufl.FiniteElement(family, domain.ufl_cell(), 1)


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
