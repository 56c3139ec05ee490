"""Random recordings of two streams of one camera, images and points, with the truth which messages belong together."""
from typing import List, NamedTuple, Tuple

import numpy as np

EPOCH = 1_700_000_000 * 10**9
IMAGE, POINTS = 0, 1


class Message(NamedTuple):
    """A message: of IMAGE or POINTS, its stamp [ns], and the frame that it shows."""

    stream: int
    stamp: int
    frame: int


def two_streams(seed: int = 0, frames: int = 600, rates: Tuple[float, float] = (30, 30), drops: float = 0.2,
                offset: float = 0.010, jitter: float = 0.004, late: Tuple[float, float] = (0.0, 0.0),
                burst: int = 1) -> List[Message]:
    """Return the messages of both streams in the order of their arrival, so many of a stream at once (burst).

    Of the rates [Hz] the greater one is a multiple of the other. Stamps of points are offset +- jitter [s] after those
    of the images; messages arrive late by a time of each stream [s], but for a share that drops.
    """
    rng = np.random.default_rng(seed)
    fastest, events = max(rates), []
    for frame in range(frames):
        for stream in (IMAGE, POINTS):
            if frame % (fastest // rates[stream]) == 0 and rng.random() >= drops:
                stamp = frame / fastest + (stream == POINTS) * (offset + rng.uniform(-jitter, jitter))
                last_of_burst = frame - frame % burst + burst - 1
                arrival = last_of_burst / fastest + (stream == POINTS) * offset + late[stream]
                events.append((arrival, Message(stream, EPOCH + round(stamp * 1e9), frame)))
    return [message for _, message in sorted(events, key=lambda event: (event[0], event[1].stamp))]
