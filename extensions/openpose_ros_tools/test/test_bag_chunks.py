"""Chunks of bags are decompressed to the size that their header says, which has a bound."""
import struct
import tracemalloc

import genpy
import pytest
import rosbag
from std_msgs.msg import String

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_tools.ros.bag_files import open_bag, stamped_messages

LONG = 'a' * (32 << 20)  # a bag of it takes some kilobytes


def texts_of(path):
    with open_bag(path) as bag:
        return [message.raw[1] for message in stamped_messages(bag, ['/text'])]


def bag_that_says(path, compression, size=None):
    """Write a bag of one chunk; its header says another size [bytes]."""
    with rosbag.Bag(str(path), 'w', compression=compression) as bag:
        bag.write('/text', String(LONG), genpy.Time(1))
    if size is not None:
        content = bytearray(path.read_bytes())
        place = content.index(b'size=') + len(b'size=')
        content[place:place + 4] = struct.pack('<I', size)
        path.write_bytes(content)
    return path


@pytest.mark.parametrize('compression', ['bz2', 'lz4'])
@pytest.mark.parametrize('size, words', [
    (1000, 'more than the 1000 bytes'), (1 << 29, 'less than the 536870912 bytes'), (1 << 31, 'expected at most')])
def test_a_chunk_of_another_size_is_refused(tmp_path, compression, size, words):
    path = bag_that_says(tmp_path / 'a.bag', compression, size)
    tracemalloc.start()
    try:
        with pytest.raises(BadInputError, match=f'a.bag is damaged, .*{words}'):
            texts_of(path)
        # bytes beyond the size take no memory
        assert size != 1000 or tracemalloc.get_traced_memory()[1] < len(LONG)
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
def test_chunks_of_their_own_size_are_read(tmp_path, compression):
    assert texts_of(bag_that_says(tmp_path / 'a.bag', compression)) == [struct.pack('<I', len(LONG)) + LONG.encode()]
