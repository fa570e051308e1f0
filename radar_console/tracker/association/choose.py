"""One way into all associators: they answer the same sparse problem, see `pairs`."""

from typing import Any

from numba import njit

from radar_console.estimation.gaussian import Array
from radar_console.tracker.association import gnn, jpda, nearest, pda
from radar_console.tracker.association.pairs import Ints

NN, GNN, PDA, JPDA, SET_JPDA = range(5)
KINDS = {"nn": NN, "gnn": GNN, "pda": PDA, "jpda": JPDA, "set-jpda": SET_JPDA}
"""By the name that `[tracker] associator` gives."""

_nearest, _gnn, _pda, _jpda = nearest.solve, gnn.solve, pda.solve, jpda.solve


@njit(cache=True, nogil=True, error_model="numpy")
def associate(
    kind: int,
    miss: Array,
    columns: int,
    row: Ints,
    col: Ints,
    w: Array,
    budget: float,
    p: Array,
    p_miss: Array,
    approximate: Any,
) -> None:
    """Which plot belongs to which track, by the associator `kind`.

    Parameters
    ----------
    kind : NN, GNN, PDA, JPDA, or SET_JPDA, which has the same probabilities
    miss : (tracks,)   weight of no plot, 1 - P_D P_G
    columns : number of plots
    row, col : (pairs,)   track, ascending, and plot of each pair inside a gate
    w : (pairs,)   P_D N(z) / λ
    budget : steps of JPDA's exact sums; clusters beyond it are approximated
    p : (pairs,)   filled with the probability of each pair; of NN and GNN 0 or 1
    p_miss : (tracks,)   filled with that of no plot
    approximate : (tracks,) bool   filled: the budget did not suffice for the track's cluster
    """
    if kind in (JPDA, SET_JPDA):
        _jpda(miss, columns, row, col, w, budget, p, p_miss, approximate)
    elif kind == PDA:
        _pda(miss, columns, row, col, w, budget, p, p_miss, approximate)
    elif kind == GNN:
        _gnn(miss, columns, row, col, w, budget, p, p_miss, approximate)
    else:
        _nearest(miss, columns, row, col, w, budget, p, p_miss, approximate)
