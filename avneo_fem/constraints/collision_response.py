"""Take the crossings out of a step that knew nothing of self-contact.

After Bridson, Fedkiw, Anderson, Robust treatment of collisions, contact and friction for cloth
animation, SIGGRAPH 2002 (sections 7.1-7.5, without friction): gentle repulsion of what is near,
inelastic impulses for what collides, and rigid impact zones for what still does. The step takes
the unit of time, so velocities are displacements [mm] and impulses are mass times mm.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import ipctk
import numpy as np
from numpy.typing import NDArray

from avneo_fem.constraints.contact_pairs import (
    Contacts,
    colliding_pairs,
    collision_mesh,
    nearby_pairs,
)
from avneo_fem.constraints.impact_zones import ImpactZones
from avneo_fem.errors import SolveError

__all__ = ["CrossingsRemain", "Resolution", "apply_impulses", "resolve"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

#: part of the lacking distance that repulsion adds in one step (Bridson et al., section 7.2)
REPULSION = 0.1
_SWEEPS = 10  # over the known pairs, per search for new ones: sweeps are cheap, searches are not


class CrossingsRemain(SolveError):
    """A step could not be made free of crossings.

    Parameters
    ----------
    pairs : int
        How many pairs (point and triangle, edge and edge) still meet on the way.
    """

    def __init__(self, pairs: int) -> None:
        self.pairs = pairs
        super().__init__(f"collisions not resolved: {pairs} pairs still meet; take a smaller step")

    def __reduce__(self) -> tuple[type[CrossingsRemain], tuple[int]]:
        """Rebuild from the number: so that the error can travel between processes."""
        return type(self), (self.pairs,)


@dataclass(frozen=True)
class Resolution:
    """A step free of crossings, and what it took.

    Attributes
    ----------
    points : (n, 3) array
        Positions to end with [mm].
    rounds : int
        Rounds of collision impulses.
    impulses : int
        Impulses given, those of repulsion included.
    zones, zone_nodes : int
        Rigid impact zones at the end, and nodes in them.
    largest_correction : float
        Largest distance of ``points`` from what was asked for [mm].
    """

    points: Floats
    rounds: int
    impulses: int
    zones: int
    zone_nodes: int
    largest_correction: float


def _batches(nodes: Ints, count: int) -> Iterator[Ints]:
    """Rows of ``nodes`` (k, 4) in batches in which no node occurs twice."""
    # a random order, the same every time: in the given one neighbours would wait for each other
    order = np.random.default_rng(len(nodes)).permutation(len(nodes))
    left = np.arange(len(nodes))
    while len(left):
        first = np.full(count, len(nodes))
        np.minimum.at(first, nodes[left], order[left][:, None])
        ready = (first[nodes[left]] == order[left][:, None]).all(axis=1)
        yield left[ready]
        left = left[~ready]


def apply_impulses(
    points: Floats, contacts: Contacts, inverse_mass: Floats, sweeps: int = 1
) -> tuple[Floats, int]:
    """Push apart, one after the other, the pairs that end nearer than they should.

    Parameters
    ----------
    points : (n, 3) array
        Positions at the end of the step [mm].
    contacts : Contacts
        k pairs with the gaps they should end with.
    inverse_mass : (n,) array
        1 / mass; 0 for a node that is held.
    sweeps : int
        Times to go through all pairs.

    Returns
    -------
    points : (n, 3) array
        New positions [mm]. Every impulse acts on the two parts with opposite sign, so the sum of
        mass times displacement over free nodes changes only by what held nodes take up.
    impulses : int
        Number given.
    """
    moved, given = points.copy(), 0
    lightness = np.einsum("kn,kn->k", contacts.weights**2, inverse_mass[contacts.nodes])
    usable = np.flatnonzero((lightness > 0) & contacts.normals.any(axis=1))
    batches = [usable[rows] for rows in _batches(contacts.nodes[usable], len(points))]
    for _ in range(sweeps):
        before = given
        for rows in batches:
            nodes, weights, normals = (
                contacts.nodes[rows],
                contacts.weights[rows],
                contacts.normals[rows],
            )
            gap = np.einsum("kn,kni,ki->k", weights, moved[nodes], normals)
            lacking = contacts.gaps[rows] - gap
            lacking[lacking < 1e-9 * contacts.gaps[rows]] = 0.0
            push = (lacking.clip(min=0.0) / lightness[rows])[:, None] * normals
            share = weights * inverse_mass[nodes]
            moved[nodes] += share[:, :, None] * push[:, None, :]
            given += int(np.count_nonzero(lacking))
        if given == before:
            break
    return moved, given


def _checked(mesh: ipctk.CollisionMesh, before: Floats, mass: Floats, held: Bools) -> None:
    if not (mass[~held] > 0).all():
        raise ValueError("mass: free nodes need a positive one")
    if ipctk.has_intersections(mesh, np.asfortranarray(before)):
        raise ValueError("before: crosses itself; only a step from a state without is resolved")


def _still_colliding(
    mesh: ipctk.CollisionMesh,
    before: Floats,
    last: Floats,
    points: Floats,
    contacts: Contacts,
    thickness: float,
) -> Contacts:
    """Collisions after ``last`` with its ``contacts`` became ``points``: the rest is as it was."""
    changed = (last != points).any(axis=1)
    changed[contacts.nodes] = True
    return colliding_pairs(mesh, before, points, thickness, changed)


def resolve(
    triangles: Ints,
    before: Floats,
    after: Floats,
    mass: Floats,
    held: Bools,
    thickness: float,
    *,
    rest: Floats | None = None,
    rounds: int = 10,
) -> Resolution:
    """Positions near ``after`` that can be reached from ``before`` without a collision.

    Parameters
    ----------
    triangles : (m, 3) int array
        One surface, or several: all their triangles keep off each other.
    before, after : (n, 3) arrays
        Positions free of crossings, and those asked for [mm].
    mass : (n,) array
        Of the nodes, in any unit: a heavier one gives way less.
    held : (n,) bool array
        These end exactly where ``after`` has them.
    thickness : float
        Distance to keep [mm]. What is nearer at the start gets a tenth of what lacks, what
        collides ends this far apart or as far as it began.
    rest : (n, 3) array, optional
        Stress-free positions [mm]: pairs nearer than ``thickness`` there, as the neighbours of a
        fine mesh are, are repelled to no more than that distance. Without it, all are.
    rounds : int
        Most rounds of impulses before rigid impact zones take over.

    Returns
    -------
    Resolution
        ``after`` itself when nothing is near and nothing collides.

    Raises
    ------
    CrossingsRemain
        When held nodes are what collides. A zone with held nodes stays where it was or, if they
        move, follows the rigid motion nearest to theirs; if theirs is not rigid, pairs inside
        the zone may go on colliding, and then this is raised.
    ValueError
        When ``before`` crosses itself or a free node has no mass.

    Notes
    -----
    Triangles that share a node are not kept from folding onto each other.
    """
    mesh = collision_mesh(before, triangles)
    _checked(mesh, before, mass, held)
    inverse_mass = np.zeros(len(before))
    inverse_mass[~held] = 1.0 / mass[~held]

    known = nearby_pairs(mesh, before, thickness, REPULSION, rest)
    points, impulses = apply_impulses(after, known, inverse_mass)
    contacts, used = colliding_pairs(mesh, before, points, thickness), 0
    while len(contacts) and used < rounds:
        used += 1
        known = known.replaced_by(contacts)  # or one repair would undo another, in turns
        last = points
        points, given = apply_impulses(points, known, inverse_mass, _SWEEPS)
        impulses += given
        contacts = _still_colliding(mesh, before, last, points, contacts, thickness)

    impulsive, merging = points, ImpactZones(before, mass, held)
    while len(contacts):
        if not merging.merge(contacts.nodes):
            raise CrossingsRemain(len(contacts))
        last, points = points, merging.moved(impulsive)
        contacts = _still_colliding(mesh, before, last, points, contacts, thickness)

    if used or merging.size()[0]:
        remaining = len(colliding_pairs(mesh, before, points, thickness))
        crossing = ipctk.has_intersections(mesh, np.asfortranarray(points))
        if remaining or crossing:
            raise CrossingsRemain(max(remaining, 1))
    correction = np.linalg.norm(points - after, axis=1).max(initial=0.0)
    return Resolution(points, used, impulses, *merging.size(), float(correction))
