"""Worlds for the tests of the roadmaps: small, with obstacles drawn by hypothesis."""
from hypothesis import strategies as st

from mobile_planning import Boundary, Environment, PolygonObstacle, RoundObstacle

SIZE = 10.0
place = st.floats(0.0, SIZE).map(lambda value: round(value, 3))


@st.composite
def obstacles(draw):
    """Draw a disc, a box or a triangle."""
    x, y = draw(place), draw(place)
    kind = draw(st.sampled_from(('disc', 'box', 'triangle')))
    width, height = (draw(st.floats(0.2, 4.0).map(lambda value: round(value, 3))) for _ in range(2))
    if kind == 'disc':
        return RoundObstacle((x, y), width / 2)
    if kind == 'box':
        return PolygonObstacle([(x, y), (x + width, y), (x + width, y + height), (x, y + height)])
    return PolygonObstacle([(x, y), (x + width, y), (x, y + height)])


@st.composite
def environments(draw, most=5, footprint=st.just(0.0)):
    """Draw a square world with a few obstacles."""
    return Environment(Boundary((0, SIZE), (0, SIZE)), draw(st.lists(obstacles(), max_size=most)),
                       footprint=draw(footprint))


def walls():
    """Return three walls 1 m thick, each with a gap of 1.2 m at its upper end in a world of 54 m x 50 m."""
    return [PolygonObstacle([(x, 0), (x + 1, 0), (x + 1, 48.8), (x, 48.8)]) for x in (17.5, 29.5, 41.5)]


NARROW = Environment(Boundary((0, 54), (0, 50)), walls())
