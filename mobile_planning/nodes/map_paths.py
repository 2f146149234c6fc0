"""Which file a request means, and whether it may be touched.

A service is open to everybody on the network; the folders that a node was started with bound what it reads and
writes for them.
"""
from __future__ import annotations

import os
import re
from collections.abc import Sequence
from urllib.parse import unquote

from mobile_planning.errors import MapError, MapNotFound
from mobile_planning.world.map_io import expand_home, load_map
from mobile_planning.world.map_metadata import MAX_YAML_BYTES, beside, parse_metadata
from mobile_planning.world.occupancy_grid import OccupancyGrid

_SCHEME = re.compile(r'([A-Za-z][A-Za-z0-9+.-]*)://')


def local_path(url: str) -> str:
    """Return the path that a request names: a path as it is, or a URL ``file:///folder/map.yaml``.

    Parameters
    ----------
    url : str

    Returns
    -------
    str
        Empty for an empty url; a leading ``~/`` stands for the home folder.

    Raises
    ------
    MapError
        If the url has another scheme or names another host.

    Examples
    --------
    >>> local_path('file:///maps/ground%20floor.yaml')
    '/maps/ground floor.yaml'
    """
    scheme = _SCHEME.match(url)
    if scheme is None:
        return expand_home(url)
    if scheme[1].lower() != 'file':
        raise MapError(f'{url!r} is no file here: only paths and file:// are understood')
    path = unquote(url[scheme.end():])
    if path.startswith('localhost/'):
        path = path.removeprefix('localhost')
    if not path.startswith('/'):
        raise MapError(f'{url!r} names a host: a file of this one is file:///folder/map.yaml')
    return path


def check_allowed(path: str, roots: Sequence[str]) -> None:
    """Refuse a path that leads, with all links followed, out of the allowed folders.

    Parameters
    ----------
    path : str
    roots : sequence of str
        Folders; none allows every path.

    Raises
    ------
    MapError
    """
    if not roots:
        return
    real = os.path.realpath(path)
    for root in roots:
        folder = os.path.realpath(expand_home(root))
        if os.path.commonpath([real, folder]) == folder:
            return
    raise MapError(f'path {path} is not allowed: it leads out of {", ".join(roots)}')


def load_allowed(url: str, roots: Sequence[str]) -> OccupancyGrid:
    """Return the map that a request names, if its files lie in the allowed folders.

    Parameters
    ----------
    url : str
        Of the YAML file.
    roots : sequence of str
        Folders that both the YAML file and its image must lie in; none allows every path.

    Raises
    ------
    MapError
        With the code of ``nav_msgs/LoadMap``; 255 for what is not allowed.
    """
    path = local_path(url)
    if not path:
        raise MapNotFound('no map is named: the url is empty')
    check_allowed(path, roots)
    if roots and os.path.isfile(path):
        with open(path, 'rb') as file:
            check_allowed(beside(parse_metadata(file.read(MAX_YAML_BYTES + 1), path), path).image, roots)
    return load_map(path)
