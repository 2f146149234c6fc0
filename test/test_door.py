"""The package's door, and the walls behind it: what may be imported from where."""
import ast
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

import mobile_planning

PACKAGE = Path(__file__).resolve().parent.parent / 'mobile_planning'
# Imports go from a higher storey to a lower one or stay in their own area.
STOREY = {
    'errors': 0, 'geometry': 1, 'stop_flag': 1, 'world': 2, 'grid': 3, 'sampling': 3, 'fleet': 3,
    'map_masks': 3, 'cost_updates': 3, 'nearest_cell': 3, 'planning_map': 4, 'warm_up': 4, 'recording': 4,
    'outcome': 4, 'grid_routes': 5,
    'path_query': 6, 'path_server': 7, 'simulate': 8, 'nodes': 8,
    'sampling_options': 4, 'sampling_scene': 4, 'sampling_server': 7,
}


@dataclass(frozen=True)
class Import:
    """One import statement: of which module, by which, and whether it runs when the file is imported."""

    importer: str
    imported: str
    line: int
    at_import: bool

    def __str__(self):
        return f'{self.importer}:{self.line} imports {self.imported}'


def module_name(path):
    """Return the name of the module in the file ``path``."""
    parts = path.relative_to(PACKAGE.parent).with_suffix('').parts
    return '.'.join(parts[:-1] if parts[-1] == '__init__' else parts)


def is_module(name):
    """Return whether the dotted ``name`` is a module or folder of the package."""
    path = PACKAGE.parent.joinpath(*name.split('.'))
    return path.is_dir() or path.with_suffix('.py').is_file()


def imported_modules(node, path):
    """Yield the names of the modules that the import statement ``node`` of the file ``path`` brings in."""
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
        return
    base = path.relative_to(PACKAGE.parent).parts[:-node.level] if node.level else ()
    base = '.'.join([*base, *([node.module] if node.module else [])])
    for alias in node.names:
        name = f'{base}.{alias.name}'
        if base == 'mobile_planning' and alias.name in mobile_planning.__all__:
            yield f'mobile_planning.{mobile_planning._HOME_OF[alias.name]}'
        else:
            yield name if is_module(name) else base


def inside(tree, is_outer):
    """Return the ids of all nodes within those nodes of the tree that ``is_outer`` picks."""
    return {id(node) for outer in ast.walk(tree) if is_outer(outer) for node in ast.walk(outer)}


def is_function(node):
    """Return whether a node is a function, whose imports wait until it is called."""
    return isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef))


def is_for_types(node):
    """Return whether a node is an ``if TYPE_CHECKING``, whose imports never run."""
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith('TYPE_CHECKING')


def imports():
    """Return every import of the package that can run."""
    found = []
    for path in sorted(PACKAGE.rglob('*.py')):
        tree = ast.parse(path.read_text(encoding='utf-8'))
        deferred, never = inside(tree, is_function), inside(tree, is_for_types)
        found += [
            Import(module_name(path), name, node.lineno, id(node) not in deferred)
            for node in ast.walk(tree) if isinstance(node, (ast.Import, ast.ImportFrom)) and id(node) not in never
            for name in imported_modules(node, path)]
    return found


IMPORTS = imports()
OWN = [each for each in IMPORTS if each.imported.split('.')[0] == 'mobile_planning']
FOREIGN = [each for each in IMPORTS if each.imported.split('.')[0] != 'mobile_planning']


def area(module):
    """Return the part of the package that a module belongs to."""
    return module.split('.')[1] if '.' in module else ''


def run_python(code):
    """Return what a new interpreter prints that runs ``code`` in the repository."""
    done = subprocess.run([sys.executable, '-c', code], cwd=PACKAGE.parent, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize('name', mobile_planning.__all__)
def test_every_public_name_is_importable_from_the_package(name):
    value = getattr(mobile_planning, name)
    assert value.__module__.startswith('mobile_planning.')
    assert value.__doc__, 'a public name is documented'


def test_an_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match='no_such_planner'):
        mobile_planning.no_such_planner


def test_the_public_names_show_in_dir():
    assert set(mobile_planning.__all__) <= set(dir(mobile_planning))


def test_importing_the_package_loads_no_heavy_library():
    loaded = run_python('import sys; old = set(sys.modules); import mobile_planning; print(set(sys.modules) - old)')
    for library in ('rclpy', 'matplotlib', 'numba', 'scipy', 'numpy', 'shapely', 'PIL', 'yaml', 'osqp'):
        assert f"'{library}'" not in loaded


def test_the_library_works_where_ros_is_missing():
    run_python(
        'import sys\n'
        'sys.modules.update(dict.fromkeys(["rclpy", "nav_msgs", "geometry_msgs", "mobile_planning_msgs"]))\n'
        'import mobile_planning\n'
        'for name in mobile_planning.__all__: getattr(mobile_planning, name)\n'
        'field = mobile_planning.cost_to_go([[False, False]], (0, 0))\n'
        'assert field.tolist() == [[0.0, 1.0]]\n')


def test_numba_and_matplotlib_wait_until_they_are_needed():
    loaded = run_python(
        'import sys, mobile_planning\n'
        'for name in mobile_planning.__all__: getattr(mobile_planning, name)\n'
        'print(*(name for name in ("numba", "matplotlib", "rclpy", "osqp") if name in sys.modules))\n')
    assert loaded.split() == []


def test_every_module_has_a_storey():
    assert {area(module_name(path)) for path in PACKAGE.rglob('*.py')} - {'', 'drawing'} <= set(STOREY)


def test_imports_go_one_way():
    wrong = [
        str(each) for each in OWN
        if area(each.importer) not in ('', 'drawing') and area(each.imported) not in ('', 'drawing')
        and area(each.importer) != area(each.imported)
        and STOREY[area(each.importer)] <= STOREY[area(each.imported)]]
    assert wrong == []


def test_drawing_takes_arrays_and_imports_nothing_of_ours():
    wrong = [each for each in OWN if area(each.importer) == 'drawing' and area(each.imported) != 'drawing']
    assert [str(each) for each in wrong] == []


def test_drawing_is_imported_where_something_is_drawn_only():
    wrong = [
        str(each) for each in OWN
        if area(each.imported) == 'drawing' and each.at_import and area(each.importer) not in ('drawing', 'nodes')]
    assert wrong == []


def test_kernels_are_imported_when_first_used():
    wrong = [
        str(each) for each in OWN
        if each.imported.endswith('_kernels') and each.at_import and not each.importer.endswith('_kernels')]
    assert wrong == []


def test_ros_stays_in_nodes():
    wrong = [
        str(each) for each in FOREIGN
        if area(each.importer) != 'nodes'
        and (each.imported.split('.')[0].endswith(('_msgs', '_srvs', '_interfaces'))
             or each.imported.split('.')[0] in ('rclpy', 'ament_index_python'))]
    assert wrong == []


def test_numba_stays_in_kernels():
    wrong = [
        str(each) for each in FOREIGN
        if each.imported.split('.')[0] == 'numba' and not each.importer.endswith('_kernels')]
    assert wrong == []


def test_matplotlib_stays_in_drawing():
    wrong = [
        str(each) for each in FOREIGN
        if each.imported.split('.')[0] == 'matplotlib' and area(each.importer) != 'drawing']
    assert wrong == []
