"""Leave the machine code of every kernel in numba's cache, so that no request waits for the compiler.

``python -m mobile_planning.warm_up`` is the last step of the set-up.
"""
from importlib import import_module
from pkgutil import walk_packages

import mobile_planning


def kernel_modules():
    """Return the names of the package's modules of numba kernels, sorted."""
    modules = walk_packages(mobile_planning.__path__, f'{mobile_planning.__name__}.')
    return sorted(module.name for module in modules if module.name.endswith('_kernels'))


def warm_up(*areas):
    """Import the modules of kernels, of all areas if none is named; each kernel names its types, which compiles it."""
    for name in kernel_modules():
        if not areas or name.split('.')[1] in areas:
            import_module(name)


if __name__ == '__main__':
    warm_up()
