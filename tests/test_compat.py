"""What the shim around DOLFINx promises: a clean process, kernels compiled once, plain meshes."""

from __future__ import annotations

import fcntl
import json
import logging
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avneo_fem import compat
from avneo_fem.compat import fem, ufl
from run_cases import environment
from shell_cases import disc

CHILD = """
import json, logging, os, sys, warnings
warnings.simplefilter("error")
before = sys.getdlopenflags(), logging.root.level, list(logging.root.handlers)
setter = sys.setdlopenflags
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    from avneo_fem import compat
after = sys.getdlopenflags(), logging.root.level, list(logging.root.handlers)
import h5py  # PyPI's, which fails under RTLD_GLOBAL
import numpy as np
caught = []
sys.unraisablehook = lambda event: caught.append(str(event.exc_value))
mesh = compat.create_mesh(np.array([[0.0, 0], [2, 0], [0, 3]]), np.array([[0, 1, 2]]))
space = compat.function_space(mesh, compat.scalar_element(mesh, "Lagrange"))
u = compat.fem.Function(space)
u.x.array[:] = 1.0
later = u**2 * compat.ufl.dx
kept = later.signature()
first = compat.compile_form(u * compat.ufl.dx)
again = u**2 * compat.ufl.dx
files = sorted(p.name for p in compat.kernel_cache().glob("*.so"))
print(json.dumps({
    "unchanged": before == after,
    "setter": setter is sys.setdlopenflags,
    "area": compat.fem.assemble_scalar(first),
    "signatures": [kept, again.signature(), later.signature()],
    "files": files,
    "caught": caught,
    "cache": str(compat.kernel_cache()),
}))
"""


def run(code: str, cache: Path) -> dict[str, Any]:
    environment = dict(os.environ) | {"XDG_CACHE_HOME": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture(scope="module")
def cold_and_warm(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """Two fresh processes, one after the other, on a kernel cache that starts empty."""
    cache = tmp_path_factory.mktemp("cache")
    return [run(CHILD, cache) for _ in range(2)]


def test_import_leaves_the_process_as_it_was(cold_and_warm: list[dict[str, Any]]) -> None:
    """Truth: dlopen flags, their setter, the root logger's level and handlers are those from
    before the import; h5py loads afterwards."""
    for facts in cold_and_warm:
        assert facts["unchanged"]
        assert facts["setter"]


def test_signature_does_not_depend_on_the_cache(cold_and_warm: list[dict[str, Any]]) -> None:
    """Truth: a form has one signature before and after another was compiled, in the first run
    and in the second; so the second run compiles nothing."""
    cold, warm = cold_and_warm
    assert len({*cold["signatures"], *warm["signatures"]}) == 1
    assert cold["files"] == warm["files"]
    assert len(cold["files"]) >= 2
    assert cold["area"] == warm["area"] == pytest.approx(3.0)


def test_cold_compilation_raises_no_warning(cold_and_warm: list[dict[str, Any]]) -> None:
    """Truth: with warnings as errors a cache miss goes through without one, unraisable ones
    included; the kernels lie where ``kernel_cache`` says."""
    for facts in cold_and_warm:
        assert facts["caught"] == []
        assert facts["cache"] == str(Path(facts["cache"]).parent / "avneo_fem")


def test_kernel_cache_follows_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    """Truth: $XDG_CACHE_HOME/avneo_fem, and ~/.cache/avneo_fem without it or with it empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", "/somewhere")
    assert compat.kernel_cache() == Path("/somewhere/avneo_fem")
    monkeypatch.setenv("XDG_CACHE_HOME", "")
    assert compat.kernel_cache() == Path.home() / ".cache" / "avneo_fem"


def test_stale_kernels_are_cleared(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Truth: only sources without their .c.cached mark go, and none while another process holds
    the cache because it is compiling."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert compat.clear_stale_kernels() == 0
    folder = tmp_path / "avneo_fem"
    names = ["killed.c", "done.c", "done.c.cached", "killed.o", "killed.so"]
    for name in names:
        (folder / name).write_text("")
    with (folder / ".lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        assert compat.clear_stale_kernels() == 0
    assert compat.clear_stale_kernels() == 1
    assert sorted(p.name for p in folder.iterdir()) == sorted({*names, ".lock"} - {"killed.c"})


def test_mesh_and_spaces() -> None:
    """Truth: the mesh has the template's area and nodes; a linear function is interpolated and
    integrated exactly; Crouzeix-Raviart unknowns sit at the edges' midpoints."""
    mesh = disc(2)
    domain = compat.create_mesh(mesh.points, mesh.triangles)
    one = fem.Constant(domain, 1.0)
    assert fem.assemble_scalar(compat.compile_form(one * ufl.dx)) == pytest.approx(mesh.area)
    vectors = compat.function_space(domain, compat.vector_element(domain, "Lagrange"))
    rows = compat.match_points(vectors.tabulate_dof_coordinates(), mesh.points)
    np.testing.assert_array_equal(np.sort(rows), np.arange(len(mesh.points)))
    edges = compat.function_space(domain, compat.scalar_element(domain, "CR"))
    middle = mesh.points[mesh.edges].mean(axis=1)
    rows = compat.match_points(edges.tabulate_dof_coordinates(), middle)
    np.testing.assert_array_equal(np.sort(rows), np.arange(len(mesh.edges)))
    mixed = compat.mixed_space(
        domain, [compat.vector_element(domain, "Lagrange"), compat.scalar_element(domain, "CR")]
    )
    size = mixed.dofmap.index_map.size_global * mixed.dofmap.index_map_bs
    assert size == 3 * len(mesh.points) + len(mesh.edges)


def test_match_points() -> None:
    """Truth: rows invert a permutation; a point that is off, or two on one row, is refused."""
    random = np.random.default_rng(0)
    points = random.normal(size=(20, 2))
    order = random.permutation(20)
    np.testing.assert_array_equal(compat.match_points(points[order], points), np.argsort(order))
    moved = points.copy()
    moved[3, 0] += 1e-6
    with pytest.raises(RuntimeError, match="do not match"):
        compat.match_points(points, moved)
    moved[3] = points[4]
    with pytest.raises(RuntimeError, match="do not match"):
        compat.match_points(points, moved)


def test_edge_tags() -> None:
    """Truth: the tagged part of the boundary has the free edge's length, and of the others none;
    tags are sorted, one per piece."""
    mesh = disc(3)
    domain = compat.create_mesh(mesh.points, mesh.triangles)
    ends = mesh.points[mesh.free_edge]
    tags = compat.edge_tags(domain, (ends[:-1] + ends[1:]) / 2, 7)
    assert len(tags.indices) == len(ends) - 1
    assert np.all(np.diff(tags.indices) > 0)
    assert set(tags.values) == {7}
    ds = ufl.Measure("ds", domain=domain, subdomain_data=tags)
    y = ufl.SpatialCoordinate(domain)[1]
    pieces = np.linalg.norm(np.diff(ends, axis=0), axis=1)
    found = [fem.assemble_scalar(compat.compile_form(f * ds(7))) for f in (y, y / y)]
    heights = (ends[:-1, 1] + ends[1:, 1]) / 2
    assert found == pytest.approx([pieces @ heights, pieces.sum()])
    with pytest.raises(RuntimeError, match="do not match"):
        compat.edge_tags(domain, ends[1:-1] + 0.01, 7)


def test_versions() -> None:
    """Truth: the versions the modules themselves report."""
    import dolfinx

    found = compat.versions()
    assert found["dolfinx"] == dolfinx.__version__
    assert found["numpy"] == np.__version__
    assert found["python"] == ".".join(map(str, sys.version_info[:3]))
    assert found["petsc"].count(".") == 2


def test_one_process_keeps_its_excepthook() -> None:
    """Truth: without other ranks there is nobody to abort."""
    before = sys.excepthook
    compat.install_abort_on_error()
    assert sys.excepthook is before
    assert logging.root.level == logging.WARNING


@pytest.mark.skipif(shutil.which("mpirun") is None, reason="no mpirun on this machine")
def test_an_error_on_one_rank_ends_all() -> None:
    """Truth: rank 0 waits for rank 1, which fails: the run ends by itself, with an error, the
    message on stderr; without the hook it would wait until the time-out."""
    code = (
        "from avneo_fem.compat import MPI, install_abort_on_error as install\n"
        "install()\n"
        "if MPI.COMM_WORLD.rank == 1: raise ValueError('rank one is out')\n"
        "MPI.COMM_WORLD.recv(source=1)\n"
    )
    done = subprocess.run(
        ["mpirun", "-n", "2", sys.executable, "-c", code],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert done.returncode != 0
    assert "rank one is out" in done.stderr
