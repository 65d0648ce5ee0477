"""Cells whose programs begin alike go through what they have in common once, as one passage.

The state at the end of a piece follows from the film and from the pieces up to it alone. A cell that has them in common
with the cell before takes over where that one got to, the same in every bit as on its own, and goes on by itself. How
many cells share depends on their order; what they find does not.
"""

from .._jit import device
from .rows import BETWEEN, ENDED, KEPT, READY, TIGHTNESS, UNTIL, WAITING, T

# Argument of a piece.
DURATION = 2


@device
def find_shared(scale, source, columns, modulus_ratio, start_stretch, dead_load, last, shared, first_use):
    """Fill in ``shared`` (cells,): how many of the pieces before ``last`` a cell has in common with the one before it.

    At least one is left to each; where none of them lasts, nothing is shared. ``first_use`` (columns,) is a workspace.
    """
    for j in range(first_use.size):
        first_use[j] = last - 1
    lasting = last - 1
    for piece in range(last - 2, -1, -1):
        for slot in range(source.shape[1]):
            first_use[source[piece, slot]] = piece
        lasting = piece if scale[piece, DURATION] != 0.0 else lasting
    shared[0] = 0
    for cell in range(1, shared.size):
        before = cell - 1
        same = modulus_ratio[cell] == modulus_ratio[before] and start_stretch[cell] == start_stretch[before]
        same = same and dead_load[cell] == dead_load[before]
        count = last - 1 if same else 0
        for j in range(first_use.size):
            if columns[j, cell] != columns[j, before]:
                count = min(count, first_use[j])
        shared[cell] = count if count > lasting else 0


@device
def _following_branch(branch, last, joint):
    """Return the piece after ``branch`` before which cells take over next; ``last`` if there is none."""
    following = last
    for cell in range(joint.size):
        if joint[cell] > branch:
            following = min(following, joint[cell])
    return following


@device
def set_out_together(shared, last, joint, fresh, state, kept):
    """Send the cells on their way that are ``fresh``, at t = 0; the piece before which the first others take over.

    ``joint`` (cells,) becomes how many pieces each of them leaves to the one before it among them, -1 in other cells.
    """
    previous, least = -1, last
    for cell in range(joint.size):
        least = min(least, shared[cell])
        joint[cell] = -1
        if fresh[cell]:
            alike = previous >= 0 and kept[TIGHTNESS, cell] == kept[TIGHTNESS, previous]
            joint[cell] = least if alike else 0
            state[cell] = WAITING if joint[cell] > 0 else READY
            previous, least = cell, last
            fresh[cell] = False
    branch = _following_branch(0, last, joint)
    for cell in range(joint.size):
        if joint[cell] == 0:
            kept[UNTIL, cell] = branch
    return branch


@device
def take_over(branch, last, joint, state, kept):
    """Let cells take over before the piece ``branch``, and those that got there go on; where the next ones do."""
    following = _following_branch(branch, last, joint)
    source = 0
    for cell in range(joint.size):
        if joint[cell] == branch:
            for row in range(KEPT):
                kept[row, cell] = kept[row, source]
            state[cell] = state[source]
        if 0 <= joint[cell] <= branch:
            source = cell
            if state[cell] == ENDED:
                state[cell] = READY
                kept[T, cell] = BETWEEN
                kept[UNTIL, cell] = following
    return following
