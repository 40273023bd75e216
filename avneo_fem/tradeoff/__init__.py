"""Error against time: which settings of a scene are worth their time (``avneo tradeoff``)."""
