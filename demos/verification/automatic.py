"""The shells with all derivatives left to UFL, to compare the package's kernels with.

The package writes the first variation of its bending terms by hand (``mechanics.edge_turn``).
Here the same energies are differentiated twice automatically.
"""

from __future__ import annotations

from typing import Any

from avneo_fem.compat import ufl
from avneo_fem.equilibrium.high_order_shell import HighOrderShell
from avneo_fem.equilibrium.shell_model import ShellModel, ShellParameters
from avneo_fem.meshing.cusp_mesh import CuspMesh

__all__ = ["AutomaticHighOrderShell", "AutomaticShell", "automatic_shell"]


class AutomaticShell(ShellModel):
    """``ShellModel`` whose bending force is UFL's derivative of the energy."""

    def _bending(self, rigidity: Any, test: Any) -> tuple[Any, Any]:
        energy, _ = super()._bending(rigidity, test)
        return energy, ufl.derivative(energy, self._state, test)


class AutomaticHighOrderShell(HighOrderShell):
    """``HighOrderShell`` whose moments' force is UFL's derivative of their work."""

    def _moment_force(self, work: Any, test: Any) -> Any:
        return ufl.derivative(work, self._state, test)


def automatic_shell(mesh: CuspMesh, parameters: ShellParameters) -> ShellModel:
    """As ``high_order_shell.shell_model``, with automatic derivatives."""
    kind = AutomaticShell if parameters.degree == 1 else AutomaticHighOrderShell
    return kind(mesh, parameters)
