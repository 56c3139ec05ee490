"""What comes in at the ports of a node that is no message of its topics, and connections that hang."""
import struct
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector

NODE = 'cloud/people'


def ports(chain: Any, node: str) -> Any:
    """Return where a node listens: (host, port) of its XML-RPC, and of its TCPROS."""
    from urllib.parse import urlparse
    from xmlrpc.client import ServerProxy

    import rosgraph
    uri = rosgraph.Master('/faults').lookupNode(f'/{node}')
    _, _, (_, host, port) = ServerProxy(uri).requestTopic('/faults', '/diagnostics', [['TCPROS']])
    return (urlparse(uri).hostname, urlparse(uri).port), (host, port)


def sent(data: bytes, node: str, times: int = 1) -> Injector:
    """Return what sends bytes to both ports of a node."""
    def inject(chain: Any) -> None:
        import socket
        for address in ports(chain, node):
            for _ in range(times):
                with socket.create_connection(address, 5.0) as connection:
                    connection.sendall(data)
    return inject


def half_open(chain: Any) -> None:
    """Connect to both ports and say nothing; the connections stay until `closed`."""
    import socket
    # rospy lets six wait at the port of TCPROS
    chain.kept += [socket.create_connection(address, 5.0) for address, number in zip(ports(chain, NODE), (50, 5))
                   for _ in range(number)]


def closed(chain: Any) -> None:
    while chain.kept:
        chain.kept.pop().close()


def handshake(**fields: str) -> bytes:
    """Return the first bytes of a TCPROS connection."""
    lines = [f'{key}={value}'.encode() for key, value in fields.items()]
    header = b''.join(struct.pack('<I', len(line)) + line for line in lines)
    return struct.pack('<I', len(header)) + header


def garbage(topic: str, data: bytes) -> Injector:
    """Return what publishes bytes that are no message of a topic's type."""
    def inject(chain: Any) -> None:
        kind = type(chain.publishers[topic].data_class())

        class Garbage(kind):
            def serialize(self, buffer: Any) -> None:
                buffer.write(data)
        chain.publishers[topic].publish(Garbage())
    return inject


def another_type(chain: Any) -> None:
    """Publish messages of another type on the topic of the images, from a process of its own."""
    import subprocess
    command = ['rostopic', 'pub', '-1', chain.topic('image'), 'std_msgs/String', 'data: no image']
    subprocess.run(command, check=True, timeout=60.0, stdout=subprocess.DEVNULL)


def slow_subscriber(chain: Any) -> None:
    """Subscribe to the results and never read them."""
    import socket
    topic = chain.topic('openpose_ros/skeleton_3d/detected_poses_3d')
    connection = socket.create_connection(ports(chain, NODE)[1], 5.0)
    connection.sendall(handshake(callerid='/slow', topic=topic, md5sum='*', type='*'))
    chain.kept.append(connection)


FAULTS = [
    Fault('random bytes at the ports', sent(bytes(range(256)) * 40, NODE), event=''),
    Fault('TCPROS header of 4 GB', sent(b'\xff' * 8, NODE), event=''),
    Fault('TCPROS header that is cut', sent(handshake(topic='/x')[:-2], NODE), event=''),
    Fault('TCPROS header with another md5sum',
          sent(handshake(callerid='/x', service='/cloud/detect_poses_3d', md5sum='0'), NODE), event=''),
    Fault('request of 4 GB', sent(handshake(callerid='/x', service='/cloud/detect_poses_3d', md5sum='*')
                                  + b'\xff\xff\xff\xffabc', NODE), event=''),
    Fault('XML-RPC request of 4 GB', sent(b'POST / HTTP/1.1\r\nContent-Length: 4294967295\r\n\r\n<?xml', NODE),
          event=''),
    Fault('50 connections at one port and 5 at the other that say nothing', half_open, event=''),
    Fault('end of connections that say nothing', closed, event=''),
    Fault('100 connections in a row', sent(b'', NODE, times=50), event=''),
    Fault('subscriber of the results that never reads', slow_subscriber, event=''),
    Fault('bytes that are no image on the topic of the images', garbage('image', b'\xff' * 100),
          words=('100 bytes are no sensor_msgs/Image',)),
    Fault('bytes that are no cloud on the topic of the clouds', garbage('points', b'\xff' * 100),
          words=('100 bytes are no sensor_msgs/PointCloud2',)),
    Fault('message of another type on the topic of the images', another_type, event=''),
]
