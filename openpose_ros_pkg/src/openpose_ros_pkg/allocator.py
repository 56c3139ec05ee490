"""How the C library keeps the memory of large messages, and when it gives it back; without effect but with glibc."""
import ctypes
import threading
import time

# Parameters of glibc's mallopt (malloc.h).
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD, _M_ARENA_MAX = -1, -3, -8
# Freed memory that stays with the process [bytes]: a few clouds of 1920 x 1080 points (66 MB each).
_KEPT_MEMORY = 256 << 20
# The greatest threshold that older versions of glibc accept [bytes].
_LEAST_MMAP_THRESHOLD = 32 << 20
# Period of giving free memory back [s]: that takes milliseconds, and pages that are used again have to be cleared.
_TRIM_PERIOD = 60.0


def keep_large_blocks() -> None:
    """Let the allocator reuse the memory of large messages instead of returning it to the system after each.

    By default every copy of a 17 MB cloud is mapped anew and cleared page by page by the kernel. Reuse halved the
    extractor's processor time and raised the rate of the chain by half (benchmarks/live_3d.py, 960 x 540 at 15 Hz).
    """
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except AttributeError:
        return  # not glibc
    mallopt(_M_ARENA_MAX, 1)
    mallopt(_M_TRIM_THRESHOLD, _KEPT_MEMORY)
    if not mallopt(_M_MMAP_THRESHOLD, _KEPT_MEMORY):
        mallopt(_M_MMAP_THRESHOLD, _LEAST_MMAP_THRESHOLD)


def give_back_free_memory() -> None:
    """Give free memory back to the system once in a minute, from a thread of its own.

    Else what a busy moment took, as a subscriber of clouds that hangs, stays for ever in pieces between small blocks:
    after 50 minutes with many of those a node held 562 MB, of which 330 MB were in use.
    """
    try:
        trim = ctypes.CDLL(None).malloc_trim
    except AttributeError:
        return  # not glibc

    def keep_trimming() -> None:
        while True:
            time.sleep(_TRIM_PERIOD)
            trim(0)

    threading.Thread(target=keep_trimming, name='memory', daemon=True).start()
