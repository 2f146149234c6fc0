"""The tree of an RRT: its nodes, who is whose child, and which nodes are near a pose.

Nodes are found through a table of square cells over the world: each cell heads a chain of its nodes. A way is never
shorter than the straight line, so cells are searched in rings until the next ring is further away than what is found.
"""
import numpy as np
from numba import b1, f8, i8, njit, types, void

from mobile_planning.sampling.steering_kernels import CAR, LENGTHS, PARTS, steer
from mobile_planning.sampling.tree import Tree

ROWS = f8[:, ::1]
COLUMN, IDS = f8[::1], i8[::1]
TREE = types.NamedTuple((ROWS, IDS, COLUMN, IDS, ROWS, IDS, IDS, IDS, IDS, IDS, IDS, COLUMN), Tree)
# In `Tree.sizes`.
COUNT, SIDE, LEFT, RIGHT, LOWEST, HIGHEST = range(6)
#: Two poses nearer than this are one [m].
SAME = 1e-9
# The search for the nearest nodes ends when it has looked at so many and has as many as are wanted.
_LOOKED_AT = 400
#: Nodes a cell of the table has on the average, before the table is made finer.
CROWD = 4
#: Numbers of a row of ways.
WAY_ROW = 3 + PARTS


@njit(i8(TREE, f8, f8), nogil=True, cache=True, _nrt=False)
def cell_of(tree, x, y):
    """Return the cell that a point lies in, or the nearest one."""
    side = tree.sizes[SIDE]
    column = min(max(int((x - tree.box[0]) / (tree.box[2] - tree.box[0]) * side), 0), side - 1)
    row = min(max(int((y - tree.box[1]) / (tree.box[3] - tree.box[1]) * side), 0), side - 1)
    return row * side + column


@njit(void(TREE, i8), nogil=True, cache=True, _nrt=False)
def put_into_cell(tree, node):
    """Put a node into its cell."""
    side = tree.sizes[SIDE]
    cell = cell_of(tree, tree.poses[node, 0], tree.poses[node, 1])
    tree.below[node] = tree.heads[cell]
    tree.heads[cell] = node
    column, row = cell % side, cell // side
    tree.sizes[LEFT], tree.sizes[RIGHT] = min(tree.sizes[LEFT], column), max(tree.sizes[RIGHT], column)
    tree.sizes[LOWEST], tree.sizes[HIGHEST] = min(tree.sizes[LOWEST], row), max(tree.sizes[HIGHEST], row)


@njit(void(TREE), nogil=True, cache=True, _nrt=False)
def index_again(tree):
    """Make the table as fine as the number of nodes asks for, and put every node into its cell."""
    count = tree.sizes[COUNT]
    side = 4
    while 4 * side * side <= len(tree.heads) and side * side * CROWD < count:
        side *= 2
    tree.sizes[SIDE] = side
    for cell in range(side * side):
        tree.heads[cell] = -1
    tree.sizes[LEFT], tree.sizes[RIGHT], tree.sizes[LOWEST], tree.sizes[HIGHEST] = side, -1, side, -1
    for node in range(count):
        put_into_cell(tree, node)


@njit(void(TREE, i8, i8), nogil=True, cache=True, _nrt=False)
def adopt(tree, parent, node):
    """Make a node the child of another."""
    first = tree.child[parent]
    tree.parents[node], tree.before[node], tree.after[node] = parent, -1, first
    if first >= 0:
        tree.before[first] = node
    tree.child[parent] = node


@njit(void(TREE, i8), nogil=True, cache=True, _nrt=False)
def leave(tree, node):
    """Take a node from its parent's children."""
    before, after = tree.before[node], tree.after[node]
    if before >= 0:
        tree.after[before] = after
    else:
        tree.child[tree.parents[node]] = after
    if after >= 0:
        tree.before[after] = before


@njit(void(TREE, i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def set_parts(tree, node, parts):
    """Write the lengths of the parts of the way to a node."""
    for k in range(PARTS):
        tree.lengths[node, k] = parts[k]


@njit(LENGTHS(TREE, i8), nogil=True, cache=True, _nrt=False)
def parts_to(tree, node):
    """Return the lengths of the parts of the way to a node."""
    lengths = tree.lengths
    return lengths[node, 0], lengths[node, 1], lengths[node, 2], lengths[node, 3], lengths[node, 4]


@njit(types.Tuple((i8, LENGTHS))(ROWS, i8), nogil=True, cache=True, _nrt=False)
def way_in(ways, k):
    """Return word and parts of the way in a row of ``ways`` (see `find_nearest`)."""
    return int(ways[k, 2]), (ways[k, 3], ways[k, 4], ways[k, 5], ways[k, 6], ways[k, 7])


@njit(i8(TREE, f8, f8, f8, i8, f8, i8, LENGTHS), nogil=True, cache=True, _nrt=False)
def insert(tree, x, y, heading, parent, cost, word, parts):
    """Add a node, with the way from its parent, and return its number."""
    node = tree.sizes[COUNT]
    tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2] = x, y, heading
    tree.costs[node], tree.words[node], tree.child[node] = cost, word, -1
    set_parts(tree, node, parts)
    tree.sizes[COUNT] = node + 1
    adopt(tree, parent, node)
    side = tree.sizes[SIDE]
    if 4 * side * side <= len(tree.heads) and node >= 4 * CROWD * side * side:
        index_again(tree)
    else:
        put_into_cell(tree, node)
    return node


@njit(i8(TREE, f8, f8, f8), nogil=True, cache=True, _nrt=False)
def find_same(tree, x, y, heading):
    """Return the node at a pose, -1 if there is none."""
    node = tree.heads[cell_of(tree, x, y)]
    while node >= 0:
        if (abs(tree.poses[node, 0] - x) <= SAME and abs(tree.poses[node, 1] - y) <= SAME
                and 1.0 - np.cos(tree.poses[node, 2] - heading) <= SAME * SAME):
            return node
        node = tree.below[node]
    return -1


@njit(i8(TREE, i8, i8), nogil=True, cache=True, _nrt=False)
def following(tree, node, top):
    """Return the next of the nodes below ``top``, each after its parent; -1 after the last."""
    if tree.child[node] >= 0:
        return tree.child[node]
    while node != top:
        if tree.after[node] >= 0:
            return tree.after[node]
        node = tree.parents[node]
    return -1


@njit(i8(TREE, i8, f8, f8, f8, CAR, b1, IDS, ROWS, i8, i8), nogil=True, cache=True, _nrt=False)
def take_if_near(tree, node, x, y, heading, car, by_line, ids, ways, wanted, found):
    """Put a node into its place among the nearest, if it is one of them; return how many there are now."""
    line = np.sqrt((tree.poses[node, 0] - x) ** 2 + (tree.poses[node, 1] - y) ** 2)
    if found == wanted and line >= ways[found - 1, 0]:
        return found
    length, word, parts = steer(
        car, tree.poses[node, 0], tree.poses[node, 1], tree.poses[node, 2], x, y, heading)
    counts = line if by_line else length
    if found == wanted and counts >= ways[found - 1, 0]:
        return found
    place = found if found < wanted else found - 1
    while place > 0 and ways[place - 1, 0] > counts:
        ids[place] = ids[place - 1]
        for k in range(WAY_ROW):
            ways[place, k] = ways[place - 1, k]
        place -= 1
    ids[place] = node
    ways[place, 0], ways[place, 1], ways[place, 2] = counts, length, word
    for k in range(PARTS):
        ways[place, 3 + k] = parts[k]
    return min(found + 1, wanted)


@njit(i8(TREE, f8, f8, f8, CAR, b1, IDS, ROWS, i8), nogil=True, cache=True, _nrt=False)
def find_nearest(tree, x, y, heading, car, by_line, ids, ways, wanted):
    """Write the nodes with the shortest ways to a pose, the nearest first; return how many there are.

    ``ways`` (n, 8) has for each of ``ids`` (n,) what counts, then length, word and five parts. With ``by_line`` the
    straight line counts, else the way. In a crowd the search ends early: nodes further away by the line may be missed.
    """
    side, found, looked_at = tree.sizes[SIDE], 0, 0
    width = (tree.box[2] - tree.box[0]) / side
    height = (tree.box[3] - tree.box[1]) / side
    column = min(max(int((x - tree.box[0]) / width), 0), side - 1)
    row = min(max(int((y - tree.box[1]) / height), 0), side - 1)
    left, right, lowest, highest = tree.sizes[LEFT], tree.sizes[RIGHT], tree.sizes[LOWEST], tree.sizes[HIGHEST]
    # The rings before the first and the cells beside those that have nodes are passed over.
    for ring in range(max(left - column, column - right, lowest - row, row - highest, 0), side):
        if found == wanted and (
                looked_at > _LOOKED_AT or (ring - 1) * min(width, height) >= ways[found - 1, 0]):
            break
        for j in range(max(row - ring, lowest), min(row + ring, highest) + 1):
            step = 1 if j == row - ring or j == row + ring else 2 * ring
            i = column - ring
            if i < left and step == 1:
                i = left
            while i <= min(column + ring, right):
                if i >= left:
                    node = tree.heads[j * side + i]
                    while node >= 0:
                        found = take_if_near(tree, node, x, y, heading, car, by_line, ids, ways, wanted, found)
                        node, looked_at = tree.below[node], looked_at + 1
                i += step
    return found
