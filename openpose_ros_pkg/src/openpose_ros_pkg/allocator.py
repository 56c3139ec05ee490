"""How a process keeps memory and gives it back; calls of the C library are without effect where it is not glibc."""
import ctypes
import gc
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
    """Let all threads share one arena that reuses large blocks, instead of mapping each message's memory anew.

    Source: development/notes/trials.md, "Memory of large messages".
    """
    mallopt = getattr(ctypes.CDLL(None), 'mallopt', None)
    if mallopt is None:
        return
    mallopt(_M_ARENA_MAX, 1)
    mallopt(_M_TRIM_THRESHOLD, _KEPT_MEMORY)
    if not mallopt(_M_MMAP_THRESHOLD, _KEPT_MEMORY):
        mallopt(_M_MMAP_THRESHOLD, _LEAST_MMAP_THRESHOLD)


def give_back_free_memory() -> None:
    """Give free memory back to the system once in a minute, from a thread of its own; call it when all is loaded.

    Without it, free pieces between small blocks stay for ever: after 50 minutes with subscribers that hang, a node held
    562 MB, of which 330 MB were in use. Before that, Python's garbage collector runs. By itself it runs too seldom for
    rospy's reference cycles, which keep the files and buffers of ended connections. It leaves out the objects that
    exist at this call, and so takes milliseconds.
    """
    trim = getattr(ctypes.CDLL(None), 'malloc_trim', lambda pad: 0)
    gc.collect()
    gc.freeze()

    def keep_trimming() -> None:
        while True:
            time.sleep(_TRIM_PERIOD)
            gc.collect()
            trim(0)

    threading.Thread(target=keep_trimming, name='memory', daemon=True).start()
