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


def warm_up():
    """Import every module of kernels; each kernel names its types, so that this compiles it."""
    for name in kernel_modules():
        import_module(name)


if __name__ == '__main__':
    warm_up()
