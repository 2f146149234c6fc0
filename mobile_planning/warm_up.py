"""Leave the machine code of every kernel in numba's cache, so that no request waits for the compiler.

``python -m mobile_planning.warm_up`` is the last step of the set-up.
"""
from importlib import import_module
from pkgutil import walk_packages

import mobile_planning


def kernel_modules(area: str = '') -> list[str]:
    """Return the names of the modules of numba kernels, sorted: of all, or of one part of the package, as ``fleet``."""
    modules = walk_packages(mobile_planning.__path__, f'{mobile_planning.__name__}.')
    return sorted(module.name for module in modules if module.name.endswith('_kernels')
                  and module.name.startswith(f'{mobile_planning.__name__}.{area}'))


def warm_up(*areas: str) -> None:
    """Import every module of kernels, or those of some parts; each kernel names its types, so that this compiles it.

    Parameters
    ----------
    *areas : str
        Parts of the package, as ``fleet``.
    """
    for name in [name for area in areas or [''] for name in kernel_modules(area)]:
        import_module(name)


if __name__ == '__main__':
    warm_up()
