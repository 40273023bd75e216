"""Terms that keep a cusp where it belongs: signed-distance penalties, self-contact, damping.

Every term acts on node positions ``x (n, 3)`` and offers ``energy(x)``, ``gradient(x) -> (n, 3)``
and ``hessian(x) -> sparse (3n, 3n)``. A term that is not in a cusp's list costs nothing.
"""
