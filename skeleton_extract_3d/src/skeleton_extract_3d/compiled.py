"""The compiled twins of hot functions: the module `skeleton_extract_3d_lifting`, built where catkin finds pybind11.

A function that has a twin hands its arguments on to it, with the constants of its module. Where nothing is built it
computes by itself, which takes several times as long. Results agree but for rounding.
"""
import functools
from types import ModuleType
from typing import Optional, Tuple


@functools.lru_cache(maxsize=1)
def load() -> Tuple[Optional[ModuleType], str]:
    """Return the compiled module, or None and why there is none. It is looked for once in a process."""
    try:
        import skeleton_extract_3d_lifting
    except ImportError as error:
        return None, str(error)
    return skeleton_extract_3d_lifting, ''
