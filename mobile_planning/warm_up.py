"""Leave the machine code of every kernel in numba's cache, so that no request waits for the compiler.

``python -m mobile_planning.warm_up`` is the last step of the set-up; it compiles on up to four processors.
"""
from __future__ import annotations

import ast
import os
from collections.abc import Mapping, Set
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from graphlib import TopologicalSorter
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from pkgutil import walk_packages

import mobile_planning

#: A compiler takes a quarter of a gigabyte, and what waits for another module leaves little for more of them.
_MOST = 4


def kernel_modules(area: str = '') -> list[str]:
    """Return the names of the modules of numba kernels, sorted: of all, or of one part of the package, as ``fleet``."""
    modules = walk_packages(mobile_planning.__path__, f'{mobile_planning.__name__}.')
    return sorted(module.name for module in modules if module.name.endswith('_kernels')
                  and module.name.startswith(f'{mobile_planning.__name__}.{area}'))


def imports() -> dict[str, set[str]]:
    """Return for each module of kernels those that it imports from."""
    modules = kernel_modules()
    trees = {name: ast.parse(Path(find_spec(name).origin).read_text(encoding='utf-8')) for name in modules}
    return {name: {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)} & set(modules)
            for name, tree in trees.items()}


def warm_up(*areas: str) -> None:
    """Import every module of kernels, or those of some parts; each kernel names its types, so that this compiles it.

    Parameters
    ----------
    *areas : str
        Parts of the package, as ``fleet``.
    """
    for name in [name for area in areas or [''] for name in kernel_modules(area)]:
        import_module(name)


def import_all(needs: Mapping[str, Set[str]], processes: int) -> None:
    """Import modules in several processes, each after all that it needs, so that no kernel is compiled twice.

    Parameters
    ----------
    needs : mapping of str to set of str
        For each module those that it imports from.
    processes : int

    Raises
    ------
    CycleError
        Modules need each other.
    Exception
        Whatever the import of a module raises.
    """
    order = TopologicalSorter(needs)
    order.prepare()
    ready: list[str] = []
    running: dict[Future, str] = {}
    with ProcessPoolExecutor(processes) as pool:
        while order.is_active():
            ready.extend(order.get_ready())
            # What is handed to the pool is done even after an error or an interrupt: so it has nothing in store.
            while ready and len(running) < processes:
                name = ready.pop()
                running[pool.submit(_load, name)] = name
            for future in wait(running, return_when=FIRST_COMPLETED)[0]:
                future.result()
                order.done(running.pop(future))


def _load(name):
    """Import a module in another process, which cannot be handed it back."""
    import_module(name)


if __name__ == '__main__':
    import_all(imports(), min(len(os.sched_getaffinity(0)), _MOST))
