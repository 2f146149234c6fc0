"""The YAML file of a map: what an image's pixels mean and where the map lies.

The keys are those of Nav2's map server: ``image``, ``resolution``, ``origin``,
``negate``, ``occupied_thresh`` and ``free_thresh`` are required, ``mode`` may be
left out, others are ignored. The file comes from anywhere, so it is read with
care: at most 64 KiB, no aliases, no tags, no key twice, no deep nesting.
"""
from __future__ import annotations

import os
import re
from dataclasses import dataclass, replace
from enum import Enum
from math import isfinite

import yaml

from mobile_planning.errors import InvalidInput, InvalidMapMetadata
from mobile_planning.world.occupancy_grid import checked_origin, checked_resolution

MAX_YAML_BYTES = 64 * 1024
_MAX_DEPTH = 16
# PyYAML follows YAML 1.1, where 5e-2 is a string and 1:30 is 90; Nav2 reads a plain C number.
_NUMBER = re.compile(r'[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?', re.ASCII)
_NOT_FINITE = re.compile(r'[-+]?\.inf|\.nan', re.ASCII | re.IGNORECASE)
_INTEGER = re.compile(r'[-+]?[0-9]{1,9}', re.ASCII)
_BOOL = {**dict.fromkeys(('true', 'yes', 'on', 'y'), True), **dict.fromkeys(('false', 'no', 'off', 'n'), False)}


class MapMode(str, Enum):
    """How a pixel's darkness p in 0..1 becomes a cell, in Nav2's words."""

    TRINARY = 'trinary'
    """100 from ``occupied_thresh`` up, 0 down from ``free_thresh``, else -1."""
    SCALE = 'scale'
    """As trinary at the ends, and 0..100 in proportion between the thresholds."""
    RAW = 'raw'
    """The pixel's value 0..100 is the cell; anything above is -1."""


@dataclass(frozen=True)
class MapMetadata:
    """What the YAML file of a map says.

    Attributes
    ----------
    image : str
        Path of the image; relative ones start at the YAML file.
    resolution : float [m]
        Side of a cell.
    origin : tuple of three float [m, m, rad]
        Pose (x, y, yaw) of the image's lower-left corner in the map frame.
    negate : bool
        Whether white is occupied, instead of black.
    occupied_thresh, free_thresh : float
        Darkness in 0..1 from which a cell is occupied and up to which it is free.
    mode : MapMode
    """

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: MapMode = MapMode.TRINARY

    def __post_init__(self):
        if not 0 <= self.free_thresh < self.occupied_thresh <= 1:
            raise InvalidInput(f'free_thresh {self.free_thresh:g} and occupied_thresh {self.occupied_thresh:g} do not '
                               'satisfy 0 <= free_thresh < occupied_thresh <= 1')


def parse_metadata(text: bytes, name: str) -> MapMetadata:
    """Return what the text of a map's YAML file says.

    Parameters
    ----------
    text : bytes
        The whole file.
    name : str
        The file's name, for messages.

    Raises
    ------
    InvalidMapMetadata
        If the text is not YAML, too long, or says something impossible; the
        message names the file, the line, the key and its value.

    Examples
    --------
    >>> lines = b'image: a.pgm', b'resolution: 5e-2', b'origin: [1, 2, 0]', b'negate: no'
    >>> parse_metadata(b'\\n'.join((*lines, b'occupied_thresh: 0.65', b'free_thresh: 0.25')), 'a.yaml').resolution
    0.05
    """
    if len(text) > MAX_YAML_BYTES:
        raise InvalidMapMetadata(f'{name} is longer than the limit of {MAX_YAML_BYTES} bytes')
    try:
        nodes = _Nodes(text).top_level()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f', line {mark.line + 1}, column {mark.column + 1}' if mark else ''
        raise InvalidMapMetadata(f'{name}{where}: {", ".join(filter(None, (error.context, error.problem)))}') from None
    except yaml.YAMLError as error:
        raise InvalidMapMetadata(f'{name} is not YAML: {str(error).splitlines()[0]}') from None
    except RecursionError:
        raise InvalidMapMetadata(f'{name} is nested too deeply') from None
    try:
        return MapMetadata(**{key: _value(nodes, key, read, name) for key, read in _READERS.items()
                              if key in nodes or key != 'mode'})
    except InvalidInput as error:
        raise InvalidMapMetadata(f'{name}: {error}') from None


def format_metadata(metadata: MapMetadata) -> bytes:
    """Return the text of a map's YAML file, which reads back as it was to the last bit.

    Parameters
    ----------
    metadata : MapMetadata

    Returns
    -------
    bytes
    """
    fields = {'image': metadata.image, 'mode': metadata.mode.value, 'resolution': metadata.resolution,
              'origin': list(metadata.origin), 'negate': int(metadata.negate),
              'occupied_thresh': metadata.occupied_thresh, 'free_thresh': metadata.free_thresh}
    return yaml.safe_dump(fields, sort_keys=False, default_flow_style=None, allow_unicode=True,
                          width=float('inf'), encoding='utf-8')


def beside(metadata: MapMetadata, yaml_path: str) -> MapMetadata:
    """Return the metadata with the image's path resolved from the YAML file's folder."""
    return replace(metadata, image=os.path.join(os.path.dirname(yaml_path), metadata.image))


class _Nodes(yaml.SafeLoader):
    """PyYAML's composer without what a map never needs and an attacker likes."""

    def __init__(self, text: bytes):
        super().__init__(text)
        self._depth = 0

    def compose_node(self, parent, index):
        """Compose one node, if it is not an alias, not tagged and not too deep."""
        event = self.peek_event()
        if isinstance(event, yaml.AliasEvent):
            raise yaml.composer.ComposerError(None, None, f'alias *{event.anchor} is not allowed', event.start_mark)
        if event.tag is not None:
            raise yaml.composer.ComposerError(None, None, f'tag {event.tag} is not allowed', event.start_mark)
        if self._depth == _MAX_DEPTH:
            raise yaml.composer.ComposerError(None, None, f'nested deeper than {_MAX_DEPTH} levels', event.start_mark)
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def top_level(self) -> dict[str, yaml.Node]:
        """Return the file's keys with their values, still as text with line numbers."""
        root = self.get_single_node()
        if not isinstance(root, yaml.MappingNode):
            raise yaml.composer.ComposerError(None, None, 'the file holds no "key: value" lines',
                                              root and root.start_mark)
        nodes = {}
        for key, value in root.value:
            if not isinstance(key, yaml.ScalarNode):
                raise yaml.composer.ComposerError(None, None, 'a key is not a word', key.start_mark)
            if key.value in nodes:
                raise yaml.composer.ComposerError(None, None, f'key {_short(key.value)} stands twice', key.start_mark)
            nodes[key.value] = value
        return nodes


def _value(nodes, key, read, name):
    """Return the value of one key, read by its own reader."""
    if key not in nodes:
        raise InvalidMapMetadata(f'{name}: key {key} is missing')
    try:
        return read(nodes[key])
    except InvalidInput as error:
        # Only the words of the reader: resolution and origin already start with their own key.
        words = str(error) if str(error).startswith(key) else f'{key} {error}'
        raise InvalidMapMetadata(f'{name}, line {nodes[key].start_mark.line + 1}: {words}') from None


def _text(node: yaml.Node) -> str:
    """Return a scalar's text."""
    if not isinstance(node, yaml.ScalarNode):
        raise InvalidInput(f'is a {node.id}, not a single value')
    return node.value


def _number(node: yaml.Node) -> float:
    """Return a scalar as a number, quoted or not, as Nav2 does."""
    text = _text(node)
    if _NUMBER.fullmatch(text):
        value = float(text)
        if isfinite(value):
            return value
    elif not _NOT_FINITE.fullmatch(text):
        raise InvalidInput(f'{_short(text)} is not a number')
    raise InvalidInput(f'{_short(text)} is not finite')


def _share(node: yaml.Node) -> float:
    """Return a number in 0..1."""
    value = _number(node)
    if not 0 <= value <= 1:
        raise InvalidInput(f'{value:g} is not within 0..1')
    return value


def _image(node: yaml.Node) -> str:
    """Return the image's path."""
    text = _text(node)
    if not text or '\0' in text:
        raise InvalidInput(f'{_short(text)} is not the path of an image')
    return text


def _origin(node: yaml.Node) -> tuple[float, float, float]:
    """Return the pose of the lower-left corner [m, m, rad]."""
    if not isinstance(node, yaml.SequenceNode) or len(node.value) != 3:
        size = f'{len(node.value)} values' if isinstance(node, yaml.SequenceNode) else f'a {node.id}'
        raise InvalidInput(f'is {size}, not three numbers [x, y, yaw]')
    return checked_origin([_number(item) for item in node.value])


def _negate(node: yaml.Node) -> bool:
    """Return a yes or no, as a word or as an integer."""
    text = _text(node)
    if _INTEGER.fullmatch(text):
        return int(text) != 0
    if text.lower() not in _BOOL:
        raise InvalidInput(f'{_short(text)} is neither an integer nor true or false')
    return _BOOL[text.lower()]


def _mode(node: yaml.Node) -> MapMode:
    """Return the mode, written in any case."""
    text = _text(node)
    try:
        return MapMode(text.lower())
    except ValueError:
        raise InvalidInput(f'{_short(text)} is none of {", ".join(mode.value for mode in MapMode)}') from None


def _short(text: str) -> str:
    """Return the text in quotes and short enough for a message."""
    return repr(text if len(text) <= 60 else text[:57] + '...')


_READERS = {
    'image': _image,
    'resolution': lambda node: checked_resolution(_number(node)),
    'origin': _origin,
    'negate': _negate,
    'occupied_thresh': _share,
    'free_thresh': _share,
    'mode': _mode,
}
