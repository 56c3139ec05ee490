import threading

if not hasattr(threading.Thread, 'isAlive'):  # gone in Python 3.9, but the rospy of Debian 11 calls it when a node ends
    threading.Thread.isAlive = threading.Thread.is_alive  # type: ignore[attr-defined]
