"""Maps on disk: every mode and format there and back, Nav2's conventions, and files nobody should trust."""
import os
import stat
import tempfile
import warnings
import zlib
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from PIL import Image

from mobile_planning import (InvalidInput, InvalidMapData, InvalidMapMetadata, MapError, MapNotFound, OccupancyGrid,
                             load_map, save_map)

FIELDS = {'image': 'map.pgm', 'resolution': '0.05', 'origin': '[1.0, -2.0, 0.5]', 'negate': '0',
          'occupied_thresh': '0.65', 'free_thresh': '0.25'}
FREE_PGM = b'P5 2 2 255\n' + bytes([254] * 4)


def write_yaml(folder, *more_lines, **changes):
    """Write a map's YAML file with some fields changed (None: left out), and return its path."""
    lines = [f'{key}: {value}' for key, value in {**FIELDS, **changes}.items() if value is not None]
    path = folder / 'map.yaml'
    path.write_text('\n'.join([*lines, *more_lines]))
    return path


def load_pixels(folder, pixels, **changes):
    """Write the pixels as a PNG, top row first, and return the map's cells."""
    Image.fromarray(np.asarray(pixels, np.uint8)).save(folder / 'map.png')
    return load_map(write_yaml(folder, image='map.png', **changes)).data.tolist()


def load_image_bytes(folder, content, **changes):
    """Write an image file byte by byte, and return the map's cells."""
    (folder / 'map.pgm').write_bytes(content)
    return load_map(write_yaml(folder, **changes)).data.tolist()


# There and back.

def grids(values):
    """Return a strategy of grids with these cell values, anywhere."""
    cells = npst.arrays(np.int8, npst.array_shapes(min_dims=2, max_dims=2, max_side=8), elements=values)
    origins = st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-np.pi, np.pi, exclude_min=True))
    return st.builds(OccupancyGrid, cells, st.floats(1e-6, 1e3), origins)


def there_and_back(grid, *arguments, **options):
    """Return the grid after a save and a load."""
    with tempfile.TemporaryDirectory() as folder:
        return load_map(save_map(grid, Path(folder) / 'map', *arguments, **options))


@settings(max_examples=30)
@given(grids(st.sampled_from([-1, 0, 100])), st.sampled_from(['pgm', 'png', 'bmp']))
def test_trinary_keeps_free_occupied_and_unknown(grid, image_format):
    assert there_and_back(grid, image_format, 'trinary') == grid


@settings(max_examples=30)
@given(grids(st.integers(-1, 100)), st.sampled_from(['pgm', 'png', 'bmp']))
def test_raw_keeps_every_value(grid, image_format):
    assert there_and_back(grid, image_format, 'raw') == grid


@settings(max_examples=30)
@given(grids(st.integers(-1, 100)))
def test_scale_between_0_and_1_keeps_every_value_in_a_png(grid):
    assert there_and_back(grid, 'png', 'scale', free_thresh=0.0, occupied_thresh=1.0) == grid


@settings(max_examples=30)
@given(grids(st.integers(0, 100)), st.sampled_from(['pgm', 'bmp']))
def test_scale_between_0_and_1_keeps_every_known_value(grid, image_format):
    assert there_and_back(grid, image_format, 'scale', free_thresh=0.0, occupied_thresh=1.0) == grid


@settings(max_examples=30)
@given(grids(st.sampled_from([-1, 0, 100])))
def test_scale_with_the_usual_thresholds_keeps_free_occupied_and_unknown(grid):
    assert there_and_back(grid, 'png', 'scale') == grid


def test_trinary_sorts_cells_by_the_thresholds_and_they_belong_to_their_side():
    grid = OccupancyGrid([[0, 25, 26, 64, 65, 100, -1]])
    assert there_and_back(grid).data.tolist() == [[0, 0, -1, -1, 100, 100, -1]]
    other = there_and_back(grid, free_thresh=0.0, occupied_thresh=0.26)
    assert other.data.tolist() == [[0, -1, 100, 100, 100, 100, -1]]


@pytest.mark.parametrize('name', ['depot', 'tb3_sandbox', 'testmap', 'TenByTen', 'willow-full'])
def test_public_maps_come_back_as_they_were(data_folder, tmp_path, name):
    path = data_folder / 'maps' / 'nav2' / f'{name}.yaml'
    if not path.exists():
        pytest.skip(f'{path} is not there')
    grid = load_map(path)
    for image_format in ('pgm', 'png', 'bmp'):
        assert load_map(save_map(grid, tmp_path / name, image_format)) == grid


# What a save writes.

@pytest.mark.parametrize('mode, pixels', [
    ('trinary', [254, 0, 205, 205]), ('raw', [0, 100, 50, 255]), ('scale', [255, 0, 127, 127])])
def test_pixels_are_those_of_nav2(tmp_path, mode, pixels):
    save_map(OccupancyGrid([[0, 100, 50, -1]]), tmp_path / 'a', 'png', mode)
    assert np.asarray(Image.open(tmp_path / 'a.png').convert('RGB'))[0, :, 0].tolist() == pixels


def test_scale_writes_unknown_as_transparent(tmp_path):
    save_map(OccupancyGrid([[0, -1]]), tmp_path / 'a', 'png', 'scale')
    image = Image.open(tmp_path / 'a.png')
    assert image.mode == 'RGBA' and np.asarray(image.getchannel('A')).tolist() == [[255, 0]]


@pytest.mark.parametrize('image_format', ['pgm', 'bmp'])
def test_scale_without_transparency_refuses_unknown_cells(tmp_path, image_format):
    with pytest.raises(InvalidInput, match='1 unknown cells in a .* image: use png'):
        save_map(OccupancyGrid([[0, -1]]), tmp_path / 'a', image_format, 'scale')
    assert list(tmp_path.iterdir()) == []


def test_the_yaml_file_says_where_the_map_lies(tmp_path):
    path = save_map(OccupancyGrid([[0]], 0.05, (1.5, -2e-5, 0.1)), tmp_path / 'a', 'png', 'raw',
                    free_thresh=0.1, occupied_thresh=0.9)
    text = Path(path).read_text()
    assert path == str(tmp_path / 'a.yaml')
    assert 'origin: [1.5, -2.0e-05, 0.1]' in text
    assert yaml.safe_load(text) == {
        'image': 'a.png', 'mode': 'raw', 'resolution': 0.05, 'origin': [1.5, -2e-5, 0.1], 'negate': 0,
        'occupied_thresh': 0.9, 'free_thresh': 0.1}


def test_trinary_writes_thresholds_that_separate_its_own_pixels(tmp_path):
    path = save_map(OccupancyGrid([[0]]), tmp_path / 'a', free_thresh=0.1, occupied_thresh=0.9)
    fields = yaml.safe_load(Path(path).read_text())
    assert (fields['occupied_thresh'], fields['free_thresh']) == (0.65, 0.196)


@pytest.mark.parametrize('name', ['a', 'a.yaml', 'v1.5', 'two words', 'ä: #é', '- x', '1e3', "it's", 'x' * 240])
def test_any_name_of_a_map_is_read_back(tmp_path, name):
    grid = OccupancyGrid([[0, 100]])
    path = save_map(grid, tmp_path / name)
    assert path == str(tmp_path / name.removesuffix('.yaml')) + '.yaml'
    assert load_map(path) == grid


def test_words_for_format_and_mode_may_be_in_any_case(tmp_path):
    assert load_map(save_map(OccupancyGrid([[7]]), tmp_path / 'a', 'PNG', 'Raw')) == OccupancyGrid([[7]])


@pytest.mark.parametrize('arguments, options, words', [
    (('tga',), {}, "'tga' is none of pgm, png, bmp"), (('',), {}, 'format'), (('pgm', 'quaternary'), {}, 'mode'),
    ((), {'occupied_thresh': 2, 'free_thresh': 2}, 'thresh'), ((), {'occupied_thresh': 0.2, 'free_thresh': 0.7}, '0.7'),
    ((), {'occupied_thresh': -2, 'free_thresh': -2}, 'thresh'), ((), {'free_thresh': np.nan}, 'nan')])
def test_a_save_that_makes_no_sense_is_refused(tmp_path, arguments, options, words):
    with pytest.raises(InvalidInput, match=words):
        save_map(OccupancyGrid([[0]]), tmp_path / 'a', *arguments, **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('path', ['', '.yaml', 'folder/'])
def test_a_save_without_a_name_is_refused(path):
    with pytest.raises(InvalidInput, match='names no map'):
        save_map(OccupancyGrid([[0]]), path)


@pytest.mark.parametrize('path', ['missing/a', 'a\0b', 'x' * 300])
def test_a_save_to_where_nothing_can_be_written_is_a_map_error(tmp_path, path):
    with pytest.raises(MapError, match='cannot be written'):
        save_map(OccupancyGrid([[0]]), tmp_path / path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize('blocked', ['a.pgm', 'a.yaml'])
def test_a_save_over_a_folder_is_refused_before_anything_is_written(tmp_path, blocked):
    (tmp_path / blocked).mkdir()
    with pytest.raises(MapError, match='not a regular file'):
        save_map(OccupancyGrid([[0]]), tmp_path / 'a')
    assert [entry.name for entry in tmp_path.iterdir()] == [blocked]


def test_a_save_that_fails_half_way_leaves_the_old_map_whole(tmp_path, monkeypatch):
    old = OccupancyGrid([[0, 100]])
    save_map(old, tmp_path / 'a')

    def no_space(*_):
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr('mobile_planning.world.map_io.format_metadata', no_space)
    with pytest.raises(MapError, match='No space left on device'):
        save_map(OccupancyGrid([[100]]), tmp_path / 'a')
    assert load_map(tmp_path / 'a.yaml') == old
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ['a.pgm', 'a.yaml']


def test_saved_files_have_ordinary_permissions(tmp_path):
    (tmp_path / 'ordinary').write_text('')
    save_map(OccupancyGrid([[0]]), tmp_path / 'a')
    modes = {stat.S_IMODE(os.stat(tmp_path / name).st_mode) for name in ('ordinary', 'a.pgm', 'a.yaml')}
    assert len(modes) == 1


# What a load makes of the pixels.

def test_the_first_image_row_is_the_highest(tmp_path):
    assert load_pixels(tmp_path, [[254, 0], [254, 254], [0, 0]]) == [[100, 100], [0, 0], [0, 100]]


def test_resolution_and_origin_are_kept(tmp_path):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    grid = load_map(write_yaml(tmp_path))
    assert (grid.resolution, grid.origin) == (0.05, (1.0, -2.0, 0.5))


@pytest.mark.parametrize('mode, cells', [
    ('trinary', [0, 0, -1, -1, 100, 100]), ('scale', [0, 0, 1, 99, 100, 100]), ('raw', [-1, -1, -1, -1, -1, 0])])
def test_a_pixel_on_a_threshold_belongs_to_its_side(tmp_path, mode, cells):
    # 51/255 and 153/255 are the darkness 0.2 and 0.6 exactly.
    assert load_pixels(tmp_path, [[255, 204, 203, 103, 102, 0]], mode=mode, free_thresh='0.2',
                       occupied_thresh='0.6') == [cells]


def test_every_shade_can_be_a_threshold(tmp_path):
    for darkness in range(1, 255):
        shade = 255 - darkness
        pixels = [[shade + 1, shade, shade - 1]]
        assert load_pixels(tmp_path, pixels, occupied_thresh=darkness / 255, free_thresh=0)[0][1:] == [100, 100]
        assert load_pixels(tmp_path, pixels, free_thresh=darkness / 255, occupied_thresh=1)[0][:2] == [0, 0]


def test_scale_stretches_what_lies_between_the_thresholds(tmp_path):
    darkness = np.arange(256) / 255
    expected = [100 if p >= 0.65 else 0 if p <= 0.25 else round((p - 0.25) / 0.4 * 100) for p in darkness]
    assert load_pixels(tmp_path, [255 - np.arange(256)], mode='scale') == [expected]


def test_raw_takes_the_pixel_as_it_is(tmp_path):
    assert load_pixels(tmp_path, [[0, 1, 100, 101, 255]], mode='raw', negate='1') == [[0, 1, 100, -1, -1]]


@pytest.mark.parametrize('negate', ['1', 'true', 'True', 'yes', 'on', '"1"', '2'])
def test_negated_white_is_occupied(tmp_path, negate):
    assert load_pixels(tmp_path, [[255, 0, 128]], negate=negate) == [[100, 0, -1]]


@pytest.mark.parametrize('negate', ['0', 'false', 'False', 'no', 'off'])
def test_not_negated_black_is_occupied(tmp_path, negate):
    assert load_pixels(tmp_path, [[255, 0, 128]], negate=negate) == [[0, 100, -1]]


@pytest.mark.parametrize('mode, cells', [
    ('trinary', [0, -1, -1, 100]), ('scale', [0, -1, -1, 100]), ('raw', [-1, -1, -1, 0])])
def test_a_pixel_that_is_not_opaque_is_unknown_except_in_raw(tmp_path, mode, cells):
    gray_and_alpha = np.array([[(255, 255), (255, 254), (254, 0), (0, 255)]], np.uint8)
    Image.fromarray(gray_and_alpha, 'LA').save(tmp_path / 'map.png')
    assert load_map(write_yaml(tmp_path, image='map.png', mode=mode)).data.tolist() == [cells]
    rgba = np.dstack([gray_and_alpha[..., :1]] * 3 + [gray_and_alpha[..., 1:]])
    assert load_pixels(tmp_path, rgba, mode=mode) == [cells]


@pytest.mark.parametrize('mode', ['1', 'P', 'RGB', 'L', 'I;16'])
def test_black_and_white_mean_the_same_in_every_kind_of_image(tmp_path, mode):
    black_and_white = np.array([[255, 0, 0]], np.uint8)
    image = (Image.fromarray(black_and_white.astype(np.uint16) * 257) if mode == 'I;16'
             else Image.fromarray(black_and_white).convert(mode))
    image.save(tmp_path / 'map.png')
    assert load_map(write_yaml(tmp_path, image='map.png')).data.tolist() == [[0, 100, 100]]


def test_a_transparent_palette_entry_is_unknown(tmp_path):
    image = Image.fromarray(np.array([[255, 0, 9]], np.uint8)).convert('P')
    image.save(tmp_path / 'map.png', transparency=9)
    assert load_map(write_yaml(tmp_path, image='map.png')).data.tolist() == [[0, 100, -1]]


@pytest.mark.parametrize('colour, shade', [((255, 0, 0), 76), ((0, 255, 0), 150), ((0, 0, 255), 29)])
def test_colours_count_by_their_luma(tmp_path, colour, shade):
    as_colour = load_pixels(tmp_path, [[colour]], mode='raw')
    assert as_colour == [[shade if shade <= 100 else -1]]


@pytest.mark.parametrize('content', [
    b'P2\n# made by hand\n3 2\n255\n254 0 205\n0 0 254\n', b'P2 3 2 # width, height\n255 254 0 205 0 0 254',
    b'P5\n# made by a program\n3 2\n255\n\xfe\x00\xcd\x00\x00\xfe', b'P2 3 2 15 15 0 12 0 0 15',
    b'P5 3 2 65535\n\xff\xff\x00\x00\xcd\xcd\x00\x00\x00\x00\xff\xff', b'P5 3 2 100\n\x64\x00\x50\x00\x00\x64'])
def test_pgm_files_of_all_kinds_are_read(tmp_path, content):
    assert load_image_bytes(tmp_path, content, free_thresh='0.19') == [[100, 100, 0], [0, 100, -1]]


# Where files are looked for.

def test_the_image_path_starts_at_the_yaml_file(tmp_path, monkeypatch):
    (tmp_path / 'images').mkdir()
    (tmp_path / 'images' / 'map.pgm').write_bytes(FREE_PGM)
    monkeypatch.chdir('/')
    assert load_map(write_yaml(tmp_path, image='images/map.pgm')).shape == (2, 2)
    assert load_map(write_yaml(tmp_path, image=tmp_path / 'images' / 'map.pgm')).shape == (2, 2)
    monkeypatch.chdir(tmp_path)
    assert load_map('map.yaml').shape == (2, 2)


def test_the_home_folder_is_meant_by_a_tilde(tmp_path, monkeypatch):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    write_yaml(tmp_path)
    monkeypatch.setenv('HOME', str(tmp_path))
    assert load_map('~/map.yaml').shape == (2, 2)
    assert save_map(OccupancyGrid([[0]]), '~/saved') == str(tmp_path / 'saved.yaml')
    with pytest.raises(InvalidMapMetadata, match='~map.yaml'):
        load_map('~map.yaml')
    monkeypatch.delenv('HOME')
    with pytest.raises(InvalidMapMetadata, match='~/map.yaml'):
        load_map('~/map.yaml')


# YAML files that say something impossible.

def test_no_path_is_no_map():
    with pytest.raises(MapNotFound):
        load_map('')


def test_unknown_keys_and_quoted_numbers_do_no_harm(tmp_path):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    path = write_yaml(tmp_path, 'author: {name: [me, you]}', resolution='"0.1"')
    assert load_map(path).resolution == 0.1


@pytest.mark.parametrize('text, value', [('5e-2', 0.05), ('.5', 0.5), ('1', 1.0), ('+2.', 2.0), ('1.5E+1', 15.0)])
def test_numbers_are_read_as_c_does(tmp_path, text, value):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    assert load_map(write_yaml(tmp_path, resolution=text)).resolution == value


@pytest.mark.parametrize('key, value, words', [
    ('resolution', '0', 'line 2: resolution 0.0 m'), ('resolution', '-1', '-1.0'), ('resolution', '.nan', 'finite'),
    ('resolution', '.inf', 'finite'), ('resolution', '1e999', 'finite'), ('resolution', '9e-7', '9e-07'),
    ('resolution', 'wide', "'wide' is not a number"), ('resolution', '1_0', 'number'), ('resolution', '1:30', 'number'),
    ('resolution', '[1]', 'sequence'), ('resolution', '', "''"), ('resolution', 'x' * 1000, r'x\.\.\.'),
    ('resolution', None, 'key resolution is missing'), ('image', None, 'key image is missing'),
    ('image', '', 'line 1: image'), ('image', '[a]', 'sequence'), ('image', r'"a\0b"', 'image'),
    ('origin', '[1, 2]', 'line 3: origin is 2 values'), ('origin', '[1, 2, 3, 4]', '4 values'),
    ('origin', '5', 'scalar'), ('origin', '[1, .nan, 0]', 'finite'), ('origin', '[1, [2], 0]', 'sequence'),
    ('origin', '[1, 1e12, 0]', 'limit'), ('origin', '[1, a, 0]', 'number'), ('origin', None, 'origin is missing'),
    ('negate', 'maybe', "line 4: negate 'maybe'"), ('negate', '0.5', 'negate'), ('negate', None, 'negate is missing'),
    ('free_thresh', '0.65', 'free_thresh 0.65 and occupied_thresh 0.65'), ('free_thresh', '0.7', '0.7'),
    ('free_thresh', '-0.1', 'line 6: free_thresh -0.1'), ('occupied_thresh', '1.1', 'line 5: occupied_thresh 1.1'),
    ('occupied_thresh', '.nan', 'finite'), ('occupied_thresh', None, 'occupied_thresh is missing'),
    ('mode', 'quaternary', "line 7: mode 'quaternary' is none of trinary, scale, raw"), ('mode', '', 'mode'),
    ('image', '!!str map.pgm', 'line 1, column 8: tag'), ('image', '!!python/name:os.system', 'tag'),
    ('image', '*name', r'alias \*name is not allowed'), ('image', 'a: b', 'line 1'), ('image', '"a', 'line')])
def test_an_impossible_value_is_named(tmp_path, key, value, words):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    with pytest.raises(InvalidMapMetadata, match=words) as caught:
        load_map(write_yaml(tmp_path, **{key: value}))
    assert str(tmp_path / 'map.yaml') in str(caught.value) and '\n' not in str(caught.value)
    assert len(str(caught.value)) < 300


def test_a_key_that_stands_twice_is_refused(tmp_path):
    with pytest.raises(InvalidMapMetadata, match="line 7, column 1: key 'resolution' stands twice"):
        load_map(write_yaml(tmp_path, 'resolution: 0.1'))


@pytest.mark.parametrize('text', [
    b'', b'# nothing', b'- a', b'a', b'\xff\xfe\x00', b'a: "\x00"', b'a: [', b'\ta: 1', b'a: 1\n---\nb: 2',
    b'[a]: 1', b'a: &a [*a]', b'a: &a [x]\nb: [*a, *a, *a]', b'[' * 60_000, b'{' * 60_000, b'- ' * 30_000,
    b'? ' * 30_000, b'\n'.join(b' ' * depth + b'a:' for depth in range(300)), b'a: ' + b'x' * 65_536, b'\x80abc'])
def test_a_text_that_describes_no_map_is_refused(tmp_path, text):
    (tmp_path / 'map.yaml').write_bytes(text)
    with pytest.raises(InvalidMapMetadata, match='map.yaml') as caught:
        load_map(tmp_path / 'map.yaml')
    assert '\n' not in str(caught.value)


def test_a_yaml_file_is_at_most_64_kib(tmp_path):
    (tmp_path / 'map.pgm').write_bytes(FREE_PGM)
    path = write_yaml(tmp_path)
    path.write_text(path.read_text().ljust(65_536))
    assert load_map(path).shape == (2, 2)
    path.write_text(path.read_text() + ' ')
    with pytest.raises(InvalidMapMetadata, match='limit of 65536 bytes'):
        load_map(path)


@settings(max_examples=200)
@given(st.data())
def test_a_damaged_yaml_file_gives_a_map_or_a_clear_refusal(data):
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / 'map.pgm').write_bytes(FREE_PGM)
        path = write_yaml(Path(folder))
        text = bytearray(path.read_bytes())
        for _ in range(data.draw(st.integers(1, 4))):
            text[data.draw(st.integers(0, len(text) - 1))] = data.draw(st.integers(0, 255))
        path.write_bytes(text)
        try:
            assert load_map(path).shape == (2, 2)
        except MapError as error:
            assert error.code in (2, 3) and '\n' not in str(error)


# Files that are none, and images nobody should trust.

def test_only_regular_files_are_opened(tmp_path):
    os.mkfifo(tmp_path / 'fifo')
    for path in (tmp_path / 'fifo', tmp_path, '/dev/zero', tmp_path / 'missing.yaml', tmp_path / 'a\0b',
                 tmp_path / ('x' * 300)):
        with pytest.raises(InvalidMapMetadata, match='cannot be read'):
            load_map(path)
    for image in ('fifo', '.', '/dev/zero', 'missing.pgm', 'x' * 300):
        with pytest.raises(InvalidMapData, match='cannot be read'):
            load_map(write_yaml(tmp_path, image=image))


def png(width, height, rows=b''):
    """Return a PNG of 8-bit grey with any size in its header."""
    def chunk(kind, body):
        return len(body).to_bytes(4, 'big') + kind + body + zlib.crc32(kind + body).to_bytes(4, 'big')

    header = width.to_bytes(4, 'big') + height.to_bytes(4, 'big') + bytes([8, 0, 0, 0, 0])
    return (b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', header) + chunk(b'IDAT', zlib.compress(rows))
            + chunk(b'IEND', b''))


@pytest.mark.parametrize('content, words', [
    (b'P5 100000 100000 255\n', 'limit'), (b'P5 32768 1 255\n', 'limit of 32767'),
    (b'P5 10001 10000 255\n', 'limit of 100000000'), (png(12_000, 12_000), 'limit of 100000000'),
    (png(2**31 - 1, 2**31 - 1), 'limit'), (png(40_000, 10), 'limit of 32767')])
def test_a_size_above_the_limit_is_refused_before_decoding(tmp_path, content, words):
    (tmp_path / 'map.pgm').write_bytes(content)
    with pytest.raises(InvalidMapData, match=words):
        load_map(write_yaml(tmp_path))


def test_a_large_image_within_the_limit_comes_without_a_warning(tmp_path):
    row = b'\0' + b'\xff' * 9500
    (tmp_path / 'map.pgm').write_bytes(png(9500, 9500, row * 9500))
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        assert load_map(write_yaml(tmp_path)).shape == (9500, 9500)


@pytest.mark.parametrize('content', [
    b'', b'P5', b'P5 2 2 255\nx', b'P5 -2 2 255\nxxxx', b'P5 0 2 255\n', b'P5 2 2 0\nxxxx', b'P5 2 2 70000\nxxxxxxxx',
    b'P2 2 2 255\n1 2 3', b'P2 2 2 255\n1 2 3 x', b'P2 2 2 9\n1 2 3 10', b'P5 99999999999999999999 2 255\n', png(2, 2),
    png(0, 2), png(2, 2, b'\0ab\0ab')[:-30], b'GIF89a', b'BM' + bytes(60), b'%!PS-Adobe-3.0 EPSF-3.0\n', b'\x00' * 100])
def test_a_damaged_image_is_refused(tmp_path, content):
    with pytest.raises(InvalidMapData, match='map.pgm') as caught:
        load_image_bytes(tmp_path, content)
    assert '\n' not in str(caught.value)


def test_floating_point_images_are_refused(tmp_path):
    Image.fromarray(np.zeros((2, 2), np.float32)).save(tmp_path / 'map.tiff')
    with pytest.raises(InvalidMapData, match='floating-point'):
        load_map(write_yaml(tmp_path, image='map.tiff'))


@settings(max_examples=150)
@given(st.data(), st.sampled_from(['pgm', 'png', 'bmp']))
def test_a_damaged_image_gives_a_map_or_a_clear_refusal(data, image_format):
    with tempfile.TemporaryDirectory() as folder:
        path = save_map(OccupancyGrid([[0, 100, -1], [100, 0, 0]]), Path(folder) / 'map', image_format)
        image = Path(folder) / f'map.{image_format}'
        content = bytearray(image.read_bytes())
        for _ in range(data.draw(st.integers(1, 3))):
            content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
        image.write_bytes(content[:data.draw(st.integers(0, len(content)))])
        try:
            load_map(path)
        except InvalidMapData as error:
            assert '\n' not in str(error)
