"""Entry of ``avneo`` and ``python -m avneo_fem``."""

from avneo_fem.cli import main

__all__ = ["main"]

if __name__ == "__main__":
    main()
