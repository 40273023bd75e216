"""avneo_fem: virtual suturing for aortic valve neocuspidization with FEniCSx shells."""

__version__ = "0.1.0"
