"""What cases inject, where more than one needs it."""
from typing import Any, Callable

Injector = Callable[[Any], None]


def changed(part: str, **fields: Any) -> Injector:
    """Return what sends a frame of which a message, 'image', 'points' or 'info', has other values in these fields."""
    def change(frame: Any) -> None:
        for name, value in fields.items():
            setattr(getattr(frame, part), name, value)
    return altered(change)


def altered(change: Callable[[Any], None]) -> Injector:
    """Return what sends a frame after a function changed its messages."""
    def inject(chain: Any) -> None:
        frame = chain.frame()
        change(frame)
        chain.send(frame)
    return inject
