"""Maps on disk: an image and a YAML file beside it, as Nav2's map server reads and writes them.

A pixel's shade is its 8-bit grey value; colours count by their luma (ITU-R 601),
as GraphicsMagick computes it for Nav2. Images of another depth are brought to
0..255 first, in every mode: a PGM of maximum value 100 turns 50 into 128, and 16
bits lose their lower half.
"""
from __future__ import annotations

import os
import stat
import uuid
import warnings
from dataclasses import replace
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from mobile_planning.errors import (InvalidInput, InvalidMapData, InvalidMapMetadata, LimitExceeded, MapError,
                                    MapNotFound)
from mobile_planning.world.map_metadata import (MAX_YAML_BYTES, MapMetadata, MapMode, beside, format_metadata,
                                                parse_metadata)
from mobile_planning.world.occupancy_grid import FREE, MAX_CELLS, MAX_SIDE, OCCUPIED, UNKNOWN, OccupancyGrid, check_size

IMAGE_FORMATS = ('pgm', 'png', 'bmp')
# What Pillow may open. Its other readers start programs (EPS) or are of no use for a map.
_READABLE = ('PNG', 'PPM', 'BMP', 'GIF', 'JPEG', 'TIFF')
_WRITERS = {'pgm': 'PPM', 'png': 'PNG', 'bmp': 'BMP'}
_FREE_PIXEL, _OCCUPIED_PIXEL, _UNKNOWN_PIXEL = 254, 0, 205


def load_map(yaml_path: str | os.PathLike) -> OccupancyGrid:
    """Return the map that a YAML file describes.

    Thresholds belong to their side: a pixel whose darkness equals
    ``occupied_thresh`` is occupied, one that equals ``free_thresh`` is free. In the
    modes trinary and scale any pixel that is not fully opaque is unknown.

    Parameters
    ----------
    yaml_path : path
        A leading ``~/`` stands for the home folder; the image's path, if relative,
        starts at the YAML file's folder.

    Returns
    -------
    OccupancyGrid

    Raises
    ------
    MapNotFound
        If the path is empty.
    InvalidMapMetadata
        If the YAML file is missing, not a regular file, or says something impossible.
    InvalidMapData
        If the image is missing, not a regular file, damaged, or above 32767 pixels
        a side or 1e8 in all.
    """
    path = expand_home(os.fspath(yaml_path))
    if not path:
        raise MapNotFound('no map is named: the path of the YAML file is empty')
    try:
        with _open_regular(path) as file:
            text = file.read(MAX_YAML_BYTES + 1)
    except (OSError, ValueError) as error:
        raise InvalidMapMetadata(f'{path} cannot be read: {_reason(error)}') from None
    metadata = beside(parse_metadata(text, path), path)
    gray, opaque = _read_image(metadata.image)
    cells = _cell_of_shade(metadata)[gray]
    if opaque is not None and metadata.mode is not MapMode.RAW:
        cells[~opaque] = UNKNOWN
    # The first row of an image is the map's highest y.
    return OccupancyGrid(cells[::-1], metadata.resolution, metadata.origin)


def save_map(grid: OccupancyGrid, path: str | os.PathLike, image_format: str = 'pgm', mode: str = 'trinary', *,
             free_thresh: float = 0.25, occupied_thresh: float = 0.65) -> str:
    """Write a map as an image and a YAML file, and return the YAML file's path.

    Both files are complete before either takes its name, so a save that fails
    leaves what was there.

    Trinary keeps free, occupied and unknown; cells between become unknown. Raw keeps
    every value. Scale writes the value as darkness, (100 - v) %, and a load stretches
    what lies between the thresholds over 0..100, as in Nav2: values come back as they
    were with the thresholds 0 and 1; with others only 0, 100 and unknown do.

    Parameters
    ----------
    grid : OccupancyGrid
    path : path
        Without extension (``.yaml`` may stand); a leading ``~/`` is the home folder.
    image_format : {'pgm', 'png', 'bmp'}
    mode : {'trinary', 'scale', 'raw'}
        Scale marks unknown cells as transparent, which only PNG can hold.
    free_thresh, occupied_thresh : float
        In 0..1: share of 100 up to which a cell is written free, from which occupied
        (trinary), or what the YAML file says (scale, raw).

    Returns
    -------
    str

    Raises
    ------
    InvalidInput
        If the format, the mode or a threshold is not one of those above, or if the
        format cannot hold the grid.
    MapError
        If the files cannot be written.
    """
    image_format, mode = _choice(image_format, IMAGE_FORMATS, 'image format'), _choice(mode, list(MapMode), 'mode')
    stem = expand_home(os.fspath(path)).removesuffix('.yaml')
    if not os.path.basename(stem):
        raise InvalidInput(f'path {stem!r} names no map')
    metadata = MapMetadata(f'{os.path.basename(stem)}.{image_format}', grid.resolution, grid.origin, False,
                           float(occupied_thresh), float(free_thresh), MapMode(mode))
    pixels = _pixels(grid.data[::-1], metadata, image_format)
    if metadata.mode is MapMode.TRINARY:
        # The thresholds have done their work. These separate the three pixel values when the map is read:
        # 205 is a darkness of 0.1961, which Nav2's usual 0.25 would take for free.
        metadata = replace(metadata, occupied_thresh=0.65, free_thresh=0.196)
    image_path, yaml_path = f'{stem}.{image_format}', f'{stem}.yaml'
    try:
        _write_together({
            image_path: lambda file: _encode(pixels, file, image_format),
            yaml_path: lambda file: file.write(format_metadata(metadata))})
    except (OSError, ValueError) as error:
        raise MapError(f'map {yaml_path} cannot be written: {_reason(error)}') from None
    return yaml_path


def expand_home(path: str) -> str:
    """Return the path with a leading ``~/`` replaced by ``$HOME``, where that is set."""
    home = os.environ.get('HOME')
    return home + path[1:] if home and path.startswith('~/') else path


def _choice(value: str, choices: list[str], name: str) -> str:
    """Return the choice in lower case, if it is one."""
    lower = str(getattr(value, 'value', value)).lower()
    words = [str(getattr(choice, 'value', choice)) for choice in choices]
    if lower not in words:
        raise InvalidInput(f'{name} {value!r} is none of {", ".join(words)}')
    return lower


def _reason(error: Exception) -> str:
    """Return why a file operation failed, without the number and the path."""
    return getattr(error, 'strerror', None) or str(error)


def _open_regular(path: str) -> BinaryIO:
    """Open a regular file; a FIFO or a device would block or never end."""
    file = open(path, 'rb', opener=lambda name, flags: os.open(name, flags | os.O_NONBLOCK))
    if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        file.close()
        raise OSError('it is not a regular file')
    return file


def _read_image(path: str) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Return the shade of every pixel and which are opaque (None: all), top row first."""
    from PIL import Image

    try:
        with _open_regular(path) as file:
            # Our own limit is checked on the header; Pillow's warning about large images says nothing new.
            with warnings.catch_warnings():
                warnings.simplefilter('ignore', Image.DecompressionBombWarning)
                image = Image.open(file, formats=_READABLE)
            check_size(*image.size)
            return _shades(image)
    except (InvalidInput, LimitExceeded) as error:
        raise InvalidMapData(f'image {path}: {error}') from None
    except Image.DecompressionBombError:
        raise InvalidMapData(f'image {path} is above the limit of {MAX_SIDE} pixels a side and {MAX_CELLS} in all'
                             ) from None
    except Image.UnidentifiedImageError:
        raise InvalidMapData(f'image {path} is not a readable image of type {", ".join(_READABLE)}') from None
    # On a damaged file a decoder may fail with anything.
    except Exception as error:
        raise InvalidMapData(f'image {path} cannot be read: {_reason(error)}') from None


def _shades(image) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Return the 8-bit shades of a Pillow image and which pixels are opaque (None: all)."""
    if image.mode == 'F':
        raise InvalidInput('pixels are floating-point numbers, not shades of grey')
    if image.mode.startswith('I'):
        deep = np.asarray(image)
        if deep.min() < 0 or deep.max() > 65535:
            raise InvalidInput('pixels have more than 16 bits')
        return ((deep.astype(np.uint32) + 128) // 257).astype(np.uint8), None
    if not image.has_transparency_data:
        return np.asarray(image.convert('L')), None
    image = image.convert('RGBA')
    return np.asarray(image.convert('L')), np.asarray(image.getchannel('A')) == 255


def _cell_of_shade(metadata: MapMetadata) -> NDArray[np.int8]:
    """Return the cell value of each of the 256 shades."""
    shade = np.arange(256)
    if metadata.mode is MapMode.RAW:
        return np.where(shade <= OCCUPIED, shade, UNKNOWN).astype(np.int8)
    # One division, so that a threshold of k/255 meets its pixel exactly.
    darkness = (shade if metadata.negate else 255 - shade) / 255
    between = np.full(256, UNKNOWN)
    if metadata.mode is MapMode.SCALE:
        share = (darkness - metadata.free_thresh) / (metadata.occupied_thresh - metadata.free_thresh)
        between = np.floor(np.clip(share, 0, 1) * OCCUPIED + 0.5)
    return np.select([darkness >= metadata.occupied_thresh, darkness <= metadata.free_thresh],
                     [OCCUPIED, FREE], between).astype(np.int8)


def _pixels(cells: NDArray[np.int8], metadata: MapMetadata, image_format: str) -> NDArray[np.uint8]:
    """Return the grey (h, w) or RGBA (h, w, 4) pixels of the cells, top row first."""
    value = np.arange(-1, OCCUPIED + 1)
    if metadata.mode is MapMode.TRINARY:
        free, occupied = round(metadata.free_thresh * 100), round(metadata.occupied_thresh * 100)
        pixel = np.select([value < 0, value <= free, value >= occupied],
                          [_UNKNOWN_PIXEL, _FREE_PIXEL, _OCCUPIED_PIXEL], _UNKNOWN_PIXEL)
    elif metadata.mode is MapMode.RAW:
        pixel = np.where(value < 0, 255, value)
    else:
        # Rounded half down, as Nav2's colours are.
        pixel = np.where(value < 0, 127, ((OCCUPIED - value) * 255 + 49) // 100)
    # As unsigned bytes -1 is 255, and one more wraps to 0.
    gray = pixel.astype(np.uint8)[cells.view(np.uint8) + np.uint8(1)]
    unknown = cells == UNKNOWN
    if metadata.mode is not MapMode.SCALE or not unknown.any():
        return gray
    if image_format != 'png':
        raise InvalidInput(f'mode scale cannot keep {unknown.sum()} unknown cells in a {image_format} image: use png')
    # Not grey with alpha, which is half the size: GraphicsMagick, hence Nav2, does not read its alpha.
    return np.dstack([gray, gray, gray, np.where(unknown, 0, 255).astype(np.uint8)])


def _encode(pixels: NDArray[np.uint8], file: BinaryIO, image_format: str) -> None:
    """Write the pixels to an open file."""
    from PIL import Image

    Image.fromarray(np.ascontiguousarray(pixels)).save(file, format=_WRITERS[image_format])


def _write_together(writers: dict) -> None:
    """Write several files, each by its function, and give them their names once all are complete."""
    for path in writers:
        if os.path.lexists(path) and not os.path.isfile(path):
            raise OSError(f'{path} is there and is not a regular file')
    # Short names of our own in the same folder: a rename must not cross file systems, nor a name grow too long.
    parts = {path: os.path.join(os.path.dirname(path), f'.{uuid.uuid4().hex}.part') for path in writers}
    try:
        for path, write in writers.items():
            with open(parts[path], 'xb') as file:
                write(file)
                file.flush()
                os.fsync(file.fileno())
        for path, part in parts.items():
            os.replace(part, path)
    finally:
        for part in parts.values():
            if os.path.exists(part):
                os.remove(part)
