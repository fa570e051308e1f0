"""How the sweep's kernels are compiled.

A kernel that makes no arrays owns no memory, and does without numba's counts of references: for the
world's two dozen arrays these cost more, with each call, than what most kernels do for a track. numba
hands this choice down to whatever is called, so those that make arrays say so.
"""

from collections.abc import Callable
from typing import Any, TypeVar, cast

from numba import njit

Kernel = TypeVar("Kernel", bound=Callable[..., Any])


def _compiled(counted: bool, forceinline: bool = False) -> Callable[[Kernel], Kernel]:
    options = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": counted}
    return cast(Callable[[Kernel], Kernel], cast(Any, njit)(**options, forceinline=forceinline))


def bare(kernel: Kernel) -> Kernel:
    """Makes no arrays, and calls nothing that returns one."""
    return _compiled(counted=False)(kernel)


def inlined(kernel: Kernel) -> Kernel:
    """The same, for a part of a bin's work that stands in one place."""
    return _compiled(counted=False, forceinline=True)(kernel)


def owning(kernel: Kernel) -> Kernel:
    """Makes arrays, and lets them go."""
    return _compiled(counted=True)(kernel)
