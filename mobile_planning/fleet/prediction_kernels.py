"""Inner loops of the prediction: discs that drive to their targets and give way to each other, step by step.

Every function has an explicit signature: it is compiled, or read from numba's cache, when this module is imported.
None holds the GIL.
"""
import numpy as np
from numba import b1, f8, i8, njit, void

from mobile_planning.fleet.guidance_kernels import NUMBERS
from mobile_planning.fleet.sight_kernels import POINTS, ROOM, room_at

#: A line (px, py, dx, dy): the velocities to the left of the point p along the unit direction d are free.
_TINY = 1e-9


@njit(b1(f8[:, ::1], i8, f8, f8, f8, b1, f8[::1]), nogil=True, cache=True)
def best_on_line(lines, count, fastest, wish_x, wish_y, is_direction, found):
    """Find the velocity on line ``count`` that keeps to the lines before it; False if there is none.

    The one nearest to the wished velocity, or the farthest along a wished direction, in the disc of ``fastest``.
    """
    px, py, dx, dy = lines[count]
    along = px * dx + py * dy
    root = along * along + fastest * fastest - px * px - py * py
    if root < 0.0:
        return False
    root = np.sqrt(root)
    low, high = -along - root, -along + root
    for k in range(count):
        qx, qy, ex, ey = lines[k]
        cross = dx * ey - dy * ex
        ahead = ex * (py - qy) - ey * (px - qx)
        if abs(cross) < _TINY:
            if ahead < 0.0:
                return False
            continue
        at = ahead / cross
        if cross > 0.0:
            high = min(high, at)
        else:
            low = max(low, at)
        if low > high:
            return False
    if is_direction:
        at = high if wish_x * dx + wish_y * dy > 0.0 else low
    else:
        at = min(high, max(low, dx * (wish_x - px) + dy * (wish_y - py)))
    found[0], found[1] = px + at * dx, py + at * dy
    return True


@njit(i8(f8[:, ::1], i8, f8, f8, f8, b1, f8[::1]), nogil=True, cache=True)
def best_velocity(lines, count, fastest, wish_x, wish_y, is_direction, found):
    """Find the velocity that keeps to all lines and is nearest to the wish; return the line that fails, or ``count``.

    A linear program in two unknowns, line by line (de Berg et al., Computational Geometry, chapter 4).
    """
    size = np.hypot(wish_x, wish_y)
    scale = fastest / size if is_direction or size > fastest else 1.0
    found[0], found[1] = wish_x * scale, wish_y * scale
    for k in range(count):
        px, py, dx, dy = lines[k]
        if dx * (py - found[1]) - dy * (px - found[0]) > 0.0:
            x, y = found[0], found[1]
            if not best_on_line(lines, k, fastest, wish_x, wish_y, is_direction, found):
                found[0], found[1] = x, y
                return k
    return count


@njit(void(f8[:, ::1], i8, i8, f8, f8[:, ::1], f8[::1]), nogil=True, cache=True)
def least_bad_velocity(lines, count, failed, fastest, bisectors, found):
    """Find the velocity that violates the lines from ``failed`` on the least, where they leave none free."""
    worst = 0.0
    for k in range(failed, count):
        px, py, dx, dy = lines[k]
        if dx * (py - found[1]) - dy * (px - found[0]) <= worst:
            continue
        number = 0
        for j in range(k):
            qx, qy, ex, ey = lines[j]
            cross = dx * ey - dy * ex
            if abs(cross) < _TINY:
                if dx * ex + dy * ey > 0.0:
                    continue
                bisectors[number, 0], bisectors[number, 1] = 0.5 * (px + qx), 0.5 * (py + qy)
            else:
                at = (ex * (py - qy) - ey * (px - qx)) / cross
                bisectors[number, 0], bisectors[number, 1] = px + at * dx, py + at * dy
            fx, fy = ex - dx, ey - dy
            size = np.hypot(fx, fy)
            bisectors[number, 2], bisectors[number, 3] = fx / size, fy / size
            number += 1
        x, y = found[0], found[1]
        if best_velocity(bisectors, number, fastest, -dy, dx, True, found) < number:
            found[0], found[1] = x, y
        worst = dx * (py - found[1]) - dy * (px - found[0])


@njit(void(f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, f8, f8[::1]), nogil=True, cache=True)
def give_way(x, y, vx, vy, own_vx, own_vy, apart, horizon, step, share, middle, line):
    """Fill in the line that keeps a disc at rest in the origin off another one at (x, y) for ``horizon``.

    ``vx, vy`` is the own velocity relative to the other; discs touch when ``apart``; the own one takes ``share`` of
    what must change. Heading for the other's middle within the sine ``middle``, it passes on the right.
    Source: van den Berg, Guy, Lin and Manocha, Reciprocal n-body collision avoidance, 2011.
    """
    distance2 = x * x + y * y
    if distance2 > apart * apart:
        wx, wy = vx - x / horizon, vy - y / horizon
        size2, ahead = wx * wx + wy * wy, wx * x + wy * y
        if ahead < 0.0 and ahead * ahead > apart * apart * size2:
            size = max(np.sqrt(size2), _TINY)
            nx, ny = wx / size, wy / size
            ux, uy = (apart / horizon - size) * nx, (apart / horizon - size) * ny
            dx, dy = ny, -nx
        else:
            leg = np.sqrt(distance2 - apart * apart)
            if x * wy - y * wx > middle * np.sqrt(distance2 * size2):
                dx, dy = (x * leg - y * apart) / distance2, (x * apart + y * leg) / distance2
            else:
                dx, dy = -(x * leg + y * apart) / distance2, -(-x * apart + y * leg) / distance2
            along = vx * dx + vy * dy
            ux, uy = along * dx - vx, along * dy - vy
    else:
        wx, wy = vx - x / step, vy - y / step
        size = max(np.hypot(wx, wy), _TINY)
        nx, ny = wx / size, wy / size
        ux, uy = (apart / step - size) * nx, (apart / step - size) * ny
        dx, dy = ny, -nx
    line[0], line[1], line[2], line[3] = own_vx + share * ux, own_vy + share * uy, dx, dy


@njit(b1(ROOM, f8, f8, f8, f8, f8, f8[::1]), nogil=True, cache=True)
def keep_off_walls(squared, x, y, scale, radius, horizon, line):
    """Fill in the line that keeps a disc off the nearest thing static; False where that is far. Places in cells."""
    height, width = squared.shape
    if not (1.0 <= x <= width - 2.0 and 1.0 <= y <= height - 2.0):
        return False
    room = np.sqrt(room_at(squared, x, y))
    if room * scale > radius + horizon:
        return False
    gx = room_at(squared, x + 1.0, y) - room_at(squared, x - 1.0, y)
    gy = room_at(squared, x, y + 1.0) - room_at(squared, x, y - 1.0)
    size = np.hypot(gx, gy)
    if size < _TINY:
        return False
    nx, ny = gx / size, gy / size
    most = (room * scale - radius) / horizon
    line[0], line[1], line[2], line[3] = -most * nx, -most * ny, ny, -nx
    return True


@njit(i8(POINTS, POINTS, POINTS, NUMBERS, NUMBERS, i8, f8, f8, f8, f8, b1, f8[::1], f8[:, ::1]), nogil=True,
      cache=True)
def meet_others(here, velocity, wish, radii, speeds, i, step, horizon, spare, middle, has_wall, ahead, lines):
    """Fill in the lines of disc ``i`` for the others, after that of a wall; ``ahead[0]`` is 1 if one is before it."""
    number = 1 if has_wall else 0
    ahead[0] = 0.0
    for j in range(len(here)):
        rx, ry = here[j, 0] - here[i, 0], here[j, 1] - here[i, 1]
        apart = radii[i] + radii[j] + spare
        if j == i or rx * rx + ry * ry > (horizon * (speeds[i] + speeds[j]) + apart) ** 2:
            continue
        give_way(rx, ry, velocity[i, 0] - velocity[j, 0], velocity[i, 1] - velocity[j, 1], velocity[i, 0],
                 velocity[i, 1], apart, horizon, step, 0.5 if speeds[j] > 0.0 else 1.0, middle, lines[number])
        if rx * wish[i, 0] + ry * wish[i, 1] > 0.0:
            ahead[0] = 1.0
        number += 1
    return number


@njit(void(POINTS, POINTS, POINTS, NUMBERS, NUMBERS, POINTS, i8[::1], f8, f8[:, ::1]), nogil=True, cache=True)
def wish_for(here, targets, goals, radii, speeds, way, corner, step, wish):
    """Fill in the velocities (N, 2) that lead straight on; the first disc follows the corners of its way."""
    for i in range(len(here)):
        x, y = targets[i]
        if i == 0:
            while corner[0] < len(way) - 1 and np.hypot(way[corner[0], 0] - here[0, 0],
                                                        way[corner[0], 1] - here[0, 1]) < radii[0]:
                corner[0] += 1
            x, y = way[corner[0]]
        elif np.hypot(x - here[i, 0], y - here[i, 1]) < radii[i]:
            x, y = goals[i]
        ex, ey = x - here[i, 0], y - here[i, 1]
        left = np.hypot(ex, ey)
        speed = min(speeds[i], left / step) if x == goals[i, 0] and y == goals[i, 1] else speeds[i]
        wish[i, 0], wish[i, 1] = ex / max(left, _TINY) * speed, ey / max(left, _TINY) * speed


@njit(f8[:, :, ::1](POINTS, POINTS, POINTS, POINTS, NUMBERS, NUMBERS, POINTS, ROOM, NUMBERS, f8, i8, f8, f8, f8, f8, f8,
                    f8, f8), nogil=True, cache=True)
def drive_on(places, velocities, targets, goals, radii, speeds, way, squared, low, resolution, steps, step, horizon,
             spare, agility, middle, right, wall):
    """Return where the discs are (steps + 1, N, 2) [m] when all drive on, each giving way by its half.

    The first follows ``way``; a disc whose speed is 0 stands for ever. ``squared`` has its first node at ``low`` and
    nodes ``resolution`` apart. The other numbers are those of `prediction`.
    """
    count = len(places)
    track = np.empty((steps + 1, count, 2))
    track[0] = places
    velocity, new, wish = velocities.copy(), velocities.copy(), np.zeros((count, 2))
    lines, bisectors = np.empty((count + 1, 4)), np.empty((count + 1, 4))
    found, ahead, corner = np.empty(2), np.empty(1), np.ones(1, np.int64)
    cos, sin = np.cos(right), np.sin(right)
    for t in range(steps):
        here = track[t]
        wish_for(here, targets, goals, radii, speeds, way, corner, step, wish)
        for i in range(count):
            if speeds[i] <= 0.0:
                new[i, 0] = new[i, 1] = 0.0
                continue
            x, y = here[i]
            has_wall = keep_off_walls(squared, (x - low[0]) / resolution, (y - low[1]) / resolution, resolution,
                                      radii[i], wall * speeds[i], lines[0])
            number = meet_others(here, velocity, wish, radii, speeds, i, step, horizon, spare, middle, has_wall, ahead,
                                 lines)
            wish_x, wish_y = wish[i]
            if ahead[0] > 0.0 and np.hypot(goals[i, 0] - x, goals[i, 1] - y) > 3.0 * radii[i]:
                wish_x, wish_y = cos * wish_x + sin * wish_y, cos * wish_y - sin * wish_x
            failed = best_velocity(lines, number, speeds[i], wish_x, wish_y, False, found)
            if failed < number:
                least_bad_velocity(lines, number, max(failed, 1 if has_wall else 0), speeds[i], bisectors, found)
            ax, ay = found[0] - velocity[i, 0], found[1] - velocity[i, 1]
            share = min(1.0, speeds[i] / agility * step / max(np.hypot(ax, ay), _TINY))
            new[i, 0], new[i, 1] = velocity[i, 0] + share * ax, velocity[i, 1] + share * ay
        velocity[:] = new
        track[t + 1] = here + step * new
    return track
