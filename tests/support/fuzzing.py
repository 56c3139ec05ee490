"""What fuzz tests share: strategies that spoil small valid examples, and the bounds within which readers have to end.

A target calls `survives(reader, ..., size=)` for each example: the reader returns a result or raises a documented
error, within a time and with memory in proportion to its input.
"""
import copy
import math
import re
import resource
import signal
import threading
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional, Sequence, Tuple, Type

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from openpose_ros_pkg.errors import BadInputError, OpenposeRosError

# A reader may allocate this much, and so much more per byte of its input: values of text become objects of Python
# (a list of numbers takes 32 bytes for each, and rows are kept twice while a table is made).
LEAST_MEMORY, MEMORY_PER_BYTE = 128 << 20, 1000
# Each example ends within this time, whatever else the machine does [s].
LONGEST = 20.0
# What the errors of libraries say where memory ran out.
_NO_MEMORY = re.compile(r'insufficient memory|failed to allocate|bad_alloc|unable to allocate|out of memory', re.I)
_PAGE = resource.getpagesize()
# OpenBLAS takes its memory at the first product of each size, and waits for ever where it gets none.
np.linalg.svd(np.ones((64, 64)) @ np.ones((64, 64)))

_NUMBER = re.compile(rb'-?\d+(?:\.\d+)?')
_TOKENS = (b'', b'\0', b'\xff', b'\xfe\xff', b'\xc3', 'é人'.encode(), b'"', b"'", b',', b';', b'\t', b'\n', b'\r', b' ',
           b'{', b'}', b'[', b']', b':', b'- ', b'&a ', b'*a ', b'!!', b'%', b'#', b'<', b'>', b'nan', b'inf', b'-inf',
           b'1e400', b'1e5000000', b'5e-324', b'-1', b'0', b'1', b'255', b'65536', b'2147483648', b'4294967296',
           b'18446744073709551616', b'9' * 400, b'1e18', b'0x', b'0o', b'1_', b'2001-99-99', b'null', b'true',
           b'\x00\x00\x00\x00', b'\xff\xff\xff\xff', b'\xff\xff\xff\x7f', b'\x00\x00\x00\x80', b'\x01\x00\x00\x00',
           b'\x00\x00\xc0\x7f', b'\x00\x00\x80\x7f', b'\x01\x00\x00\x00\x00\x00\x00\x00', b'[' * 3000, b'{"a":' * 3000,
           b'a' * 200000)
_EDITS = ('flip', 'set', 'cut', 'remove', 'repeat', 'insert', 'overwrite', 'number', 'splice', 'line')

_position = st.integers(0, 2 ** 20 - 1)
_edit = st.tuples(st.sampled_from(_EDITS), _position, _position, st.sampled_from(_TOKENS))


def share(part: float) -> settings:
    """Return the settings of a test that takes long: a part of the examples."""
    return settings(max_examples=max(int(settings().max_examples * part), 5))


def mutated(*examples: bytes) -> st.SearchStrategy:
    """Yield the bytes of one of several valid files, spoiled: bits, cuts, splices, repeats, numbers, lines."""
    def spoil(chosen: Tuple[int, List[Any]]) -> bytes:
        content = examples[chosen[0]]
        for edit in chosen[1]:
            content = _edited(content, examples, *edit)
        return content
    return st.tuples(st.integers(0, len(examples) - 1), st.lists(_edit, max_size=4)).map(spoil)


def _edited(content: bytes, examples: Sequence[bytes], kind: str, first: int, second: int, token: bytes) -> bytes:
    size = len(content)
    begin = first * size >> 20
    end = min(begin + 1 + (second * min(size, 1 << 12) >> 20), size)
    if kind == 'flip' and size:
        return content[:begin] + bytes([content[begin] ^ 1 << second % 8]) + content[begin + 1:]
    if kind == 'set' and size:
        return content[:begin] + bytes([second % 256]) + content[begin + 1:]
    if kind == 'cut':
        return content[:begin]
    if kind == 'remove':
        return content[:begin] + content[end:]
    if kind == 'repeat':
        return content[:end] + content[begin:end] * (1 + second % 20) + content[end:]
    if kind == 'insert':
        return content[:begin] + token + content[begin:]
    if kind == 'splice':
        other = examples[second % len(examples)]
        return content[:begin] + other[second * len(other) >> 20:]
    if kind == 'number':
        places = list(_NUMBER.finditer(content))
        if places:
            place = places[first % len(places)]
            return content[:place.start()] + token + content[place.end():]
    if kind == 'line':
        lines = content.splitlines(keepends=True)
        if lines:
            moved = lines.pop(first % len(lines))
            lines[second % (len(lines) + 1):second % (len(lines) + 1)] = [moved] * (second % 3)
            return b''.join(lines)
    return content[:begin] + token + content[begin + len(token):]


NUMBERS = st.one_of(st.sampled_from((0, 1, -1, 255, 256, 65535, 65536, 2 ** 31, 2 ** 32 - 1, 2 ** 63, 2 ** 64,
                                    10 ** 400)),
                    st.integers(-5, 5), st.floats(allow_subnormal=True),
                    st.sampled_from((math.nan, math.inf, -math.inf, 5e-324, 1e-300, 1e300, -0.0)))
TEXTS = st.one_of(st.text(max_size=8), st.sampled_from(('', ' ', 'NaN', '../../etc/passwd', 'a' * 5000, '人é', '\0',
                                                       '1e5')))
JUNK = st.one_of(st.none(), st.booleans(), NUMBERS, TEXTS, st.just([]), st.just({}), st.lists(NUMBERS, max_size=4),
                 st.dictionaries(TEXTS, NUMBERS, max_size=2), st.just([[]]), st.just([[1], [2, 3]]))


def spoiled(value: Any) -> st.SearchStrategy:
    """Yield a structure of lists and mappings with some values replaced, left out, repeated or under another key."""
    def spoil(changes: List[Tuple[int, str, Any]]) -> Any:
        result = [copy.deepcopy(value)]
        for place, kind, junk in changes:
            holders = list(_holders(result))
            holder, key = holders[place % len(holders)]
            if kind == 'replace' or holder is result:
                holder[key] = copy.deepcopy(junk)
            elif kind == 'remove':
                del holder[key]
            elif isinstance(holder, list):
                holder.insert(key, copy.deepcopy(holder[key]))
            else:
                holder[str(junk)[:20]] = holder.pop(key)
        return result[0]
    return st.lists(st.tuples(_position, st.sampled_from(('replace', 'remove', 'repeat')), JUNK), max_size=3).map(spoil)


def _holders(value: Any) -> Iterator[Tuple[Any, Any]]:
    """Yield container and key of each value in a structure."""
    for key in range(len(value)) if isinstance(value, list) else list(value):
        yield value, key
        if isinstance(value[key], (list, dict)):
            yield from _holders(value[key])


def survives(read: Callable[..., Any], *arguments: Any, size: int,
             errors: Sequence[Type[Exception]] = (BadInputError,), memory: int = LEAST_MEMORY) -> Optional[Any]:
    """Return the result of a reader, None where it refused its input with one of the documented errors.

    Args:
        size: of the input [bytes].
        memory: which it may allocate whatever the size [bytes].
    """
    try:
        with limited_memory(memory + MEMORY_PER_BYTE * size), limited_time():
            return read(*arguments)
    except tuple(errors) as error:
        cause: Optional[BaseException] = error
        while cause is not None:
            assert not isinstance(cause, MemoryError) and not _NO_MEMORY.search(str(cause)[:2000]), f'memory: {cause!r}'
            cause = cause.__cause__ or cause.__context__
        assert str(error).strip(), 'an error without a text'
        assert len(str(error)) < 20000 or not isinstance(error, OpenposeRosError), 'an error too long to read'
        return None


def written(factory: Any, name: str, content: bytes) -> Path:
    """Write a file into the folder of the session: one for each example would take longer than most readers."""
    path = Path(factory.getbasetemp()) / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content)
    return path


@contextmanager
def limited_memory(most: int) -> Iterator[None]:
    """Let nothing allocate more than this beyond what the process has [bytes]."""
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    used = int(Path('/proc/self/statm').read_text().split()[5]) * _PAGE
    resource.setrlimit(resource.RLIMIT_DATA, (used + most, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


@contextmanager
def limited_time() -> Iterator[None]:
    """Raise an AssertionError where something takes too long; in the main thread alone."""
    def late(*_: Any) -> None:
        raise AssertionError(f'it takes more than {LONGEST:g} s')
    assert threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGALRM, late)
    signal.setitimer(signal.ITIMER_REAL, LONGEST)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
