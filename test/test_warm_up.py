"""Kernels are compiled by the set-up, not by the first request."""
import ast
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from mobile_planning.warm_up import kernel_modules

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
