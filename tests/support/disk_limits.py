"""A limit for the size of files, which stands for a full disk where a test has no right to mount one."""
import resource
from contextlib import contextmanager


@contextmanager
def file_size_limit(size, process=0):
    """Let a process write no file beyond a size [bytes]: it gets the error EFBIG. 0: this process."""
    before = resource.prlimit(process, resource.RLIMIT_FSIZE)
    resource.prlimit(process, resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.prlimit(process, resource.RLIMIT_FSIZE, before)
