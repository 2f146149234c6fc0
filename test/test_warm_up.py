"""Kernels are compiled by the set-up, not by the first request."""
import ast
import sys
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from mobile_planning.warm_up import import_all, imports, kernel_modules

PACKAGE = Path(__file__).resolve().parent.parent / 'mobile_planning'
KERNELS = [
    pytest.param(kernel, id=f'{module.split(".")[-1]}.{name}')
    for module in kernel_modules()
    for name, kernel in vars(import_module(module)).items() if isinstance(kernel, Dispatcher)]


def test_every_file_of_kernels_is_warmed_up():
    assert len(kernel_modules()) == len(list(PACKAGE.rglob('*_kernels.py'))) > 0


@pytest.mark.parametrize('kernel', KERNELS)
def test_a_kernel_is_compiled_once_its_module_is_imported(kernel):
    assert kernel.signatures, 'it needs an explicit signature'


@pytest.mark.parametrize('kernel', KERNELS)
def test_a_kernel_lets_other_threads_run_and_is_cached(kernel):
    assert kernel.targetoptions['nogil']
    assert kernel._cache.cache_path


@pytest.mark.parametrize('module', kernel_modules())
def test_kernels_compile_in_nothing_from_files_that_numba_does_not_watch(module):
    source = Path(import_module(module).__file__).read_text()
    imports = [node for node in ast.walk(ast.parse(source)) if isinstance(node, ast.ImportFrom)]
    foreign = [(node.module, alias.name) for node in imports for alias in node.names
               if node.module.startswith('mobile_planning') and node.module not in kernel_modules()]
    # The fields of a named tuple are part of the types that a kernel file names itself.
    values = [name for home, name in foreign if not hasattr(getattr(import_module(home), name), '_fields')]
    assert values == []


def test_modules_of_kernels_come_after_those_that_they_import_from():
    order = list(TopologicalSorter(imports()).static_order())
    assert sorted(order) == kernel_modules()
    for place, name in enumerate(order):
        loaded = {module for module in vars(import_module(name)).values() if isinstance(module, Dispatcher)}
        homes = {kernel.py_func.__module__ for kernel in loaded} - {name}
        assert homes <= set(order[:place])


@pytest.fixture
def modules(tmp_path, monkeypatch):
    """Return a function that writes a module which leaves a file, and fails without those of others."""
    def write(name, *others, fails=False):
        assert name not in sys.modules
        lines = ['from pathlib import Path', 'here = Path(__file__).parent',
                 *(f'assert (here / "{other}.done").exists()' for other in others),
                 'raise OSError("no kernels")' if fails else f'(here / "{name}.done").touch()']
        (tmp_path / f'{name}.py').write_text('\n'.join(lines))
    monkeypatch.syspath_prepend(tmp_path)
    return write


def test_modules_are_imported_by_other_processes_each_after_all_that_it_needs(modules, tmp_path):
    needs = {'warm_e': {'warm_c', 'warm_d'}, 'warm_d': {'warm_a', 'warm_b'}, 'warm_c': {'warm_a'}, 'warm_b': set(),
             'warm_a': set()}
    for name, others in needs.items():
        modules(name, *others)
    import_all(needs, 2)
    assert {each.stem for each in tmp_path.glob('*.done')} == needs.keys()
    assert not needs.keys() & sys.modules.keys()


def test_what_a_module_raises_is_raised_and_nothing_after_it_is_imported(modules, tmp_path):
    modules('warm_bad', fails=True)
    modules('warm_next', 'warm_bad')
    with pytest.raises(OSError, match='no kernels'):
        import_all({'warm_next': {'warm_bad'}, 'warm_bad': set()}, 2)
    assert not list(tmp_path.glob('*.done'))


def test_after_an_error_nothing_that_was_ready_is_imported(modules, tmp_path):
    names = [f'warm_{number}' for number in range(9)]
    for name in names:
        modules(name)
    modules('warm_worse', fails=True)
    with pytest.raises(OSError, match='no kernels'):
        # The last of those that are ready is the first.
        import_all(dict.fromkeys([*names, 'warm_worse'], set()), 1)
    assert not list(tmp_path.glob('*.done'))


def test_modules_that_need_each_other_are_refused():
    with pytest.raises(CycleError):
        import_all({'a': {'b'}, 'b': {'a'}}, 1)
