"""avneo_fem: virtual suturing for aortic valve neocuspidization with FEniCSx shells.

Importing the package only sets defaults for environment variables that must be in place before
NumPy, MPI or VTK are loaded; what the user has set is left alone.
"""

import os

__version__ = "0.1.0"

for _name, _value in {
    # one cusp per process: threads in BLAS only get in each other's way
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    # Debian's FFCx builds with setuptools' distutils, which warns otherwise (Python < 3.12)
    "SETUPTOOLS_USE_DISTUTILS": "stdlib",
    # Open MPI in containers
    "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
    "OMPI_MCA_mpi_yield_when_idle": "1",
}.items():
    os.environ.setdefault(_name, _value)
