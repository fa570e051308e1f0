"""How the sweep's kernels are compiled.

A kernel that makes no arrays owns no memory, and does without numba's counts of references: for the
world's two dozen arrays these cost more, with each call, than what most kernels do for a track. numba
hands this choice down to whatever is called, so those that make arrays say so.
"""

from numba import njit

bare = njit(cache=True, nogil=True, error_model="numpy", _nrt=False)
"""Makes no arrays, and calls nothing that returns one."""

inlined = njit(cache=True, nogil=True, error_model="numpy", forceinline=True, _nrt=False)
"""The same, for a part of a bin's work that stands in one place."""

owning = njit(cache=True, nogil=True, error_model="numpy", _nrt=True)
"""Makes arrays, and lets them go."""
