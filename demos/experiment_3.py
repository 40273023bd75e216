# %% [markdown]
# # Experiment 3: cusps of 'quasi-optimal' size
#
# Section 4.4 of the paper. Proposition 3.2 says how long free edges should be for given
# commissures: in proportion to the chords, L_f = alpha a with alpha of at least 2/sqrt(3) = 1.155.
# Here alpha is exactly that, for commissures 6 : 4 : 5 apart.
#
#     python demos/experiment_3.py [--size H] [--out DIR] [--geometry]

# %%
from __future__ import annotations

import numpy as np

from expected import asked, demand, equal, geometry_figures, suture, sutured_figures, valve

page = asked("Experiment 3: cusps of quasi-optimal size", "experiment-3")
given = valve("experiment_3.toml", page.size)

# %% [markdown]
# ## Geometry
#
# nu\* = 0.986: the cusps just close. Proposition 3.2 only promises nu\* <= 1; equality holds for
# equal chords. The contact curves need hardly bend, sigma\* is a few hundredths. *J_sl* is 0.7 to
# 0.8, so little is gathered.

# %%
geometry = given.geometry
demand(
    "Experiment 3, geometry",
    [
        *geometry_figures(
            given,
            stitching=["0.8062", "0.7152", "0.7206"],
            contact=["6.872", "16.036", "11.454"],
            nu_star="0.9859",
            sigma=["0.0303", "0.0860", "0.1059"],
            competent=True,
        ),
        *(
            equal(f"L_f / a of cusp {i}, 2/sqrt(3)", length / chord, "1.15470")
            for i, (length, chord) in enumerate(
                zip(geometry.commissure_lengths, geometry.commissures.chord_lengths, strict=True)
            )
        ),
    ],
)

# %% [markdown]
# The paper says that the contact surface "is very close to the plane". The greatest distance of
# each contact curve from its chord, and for comparison that of Experiment 1:


# %%
def bulges(curves: list[np.ndarray]) -> list[float]:
    """Greatest distance of Bezier curves, given by control points (4, 2), from their chords."""
    t = np.linspace(0.0, 1.0, 1001)[:, None]
    found = []
    for y in curves:
        points = (1 - t) ** 3 * y[0] + 3 * t * (1 - t) ** 2 * y[1] + 3 * t**2 * (1 - t) * y[2]
        away, chord = points + t**3 * y[3] - y[0], y[3] - y[0]
        across = away[:, 0] * chord[1] - away[:, 1] * chord[0]
        found.append(float(np.abs(across).max() / np.linalg.norm(chord)))
    return found


flat = bulges([given.wedges.control_points(i) for i in range(3)])
bent = bulges([valve("experiment_1.toml").wedges.control_points(0)])
print(f"contact curves leave their chords by {', '.join(f'{x:.2f}' for x in flat)} mm;", end=" ")
print(f"by {bent[0]:.1f} mm in Experiment 1")

# %% [markdown]
# ## Suturing
#
# Three different cusps, each with little to fold.

# %%
page.end_of_geometry()
report = suture(given, page.out)

# %% [markdown]
# ## What a sutured valve must show
#
# The same as in Experiment 1. Neighbouring cusps keep 0.435 mm: chords of unequal length make the
# contact surface meet the wall at a slant, so that sutured edges lie nearer to it than half a
# thickness; they are 0.445 mm from each other.

# %%
demand(
    f"Experiment 3, sutured at h = {given.scene.mesh_size:g} mm",
    sutured_figures(report, cusps_apart=0.435),
)

# %%
print(f"Experiment 3: all figures as stated; picture in {page.out / 'valve.png'}")
