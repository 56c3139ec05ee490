"""The newest frame of each camera and all requests are handled in turn; a search goes on until one of them waits."""
import threading
import time

import pytest

from openpose_ros_pkg.detect.detection import NextPart
from openpose_ros_pkg.errors import StoppedError
from openpose_ros_pkg.stream.frame_loop import LATE, FrameLoop, FrameQueue, Taken

TIMEOUT = 30.0
SHORT, LONG = NextPart(0.01), NextPart(0.5)


def wait_for(condition):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


def taken(item):
    return Taken(item, lambda one: iter(()))


def queue_of(*arrivals, camera='camera'):
    """Return a queue whose items of a camera came at these times [s] and were taken."""
    queue = FrameQueue()
    for now in arrivals:
        queue.submit(camera, taken(now), now)
        queue.take()
    return queue


def items(queue):
    """Take all items of a queue."""
    return [one.item for one in iter(queue.take, None)]


def test_cameras_take_turns():
    """Also where one of them is faster than all are handled."""
    queue, handled = FrameQueue(), []
    queue.submit('slow', taken('slow'), 0.0)
    for number in range(4):
        queue.submit('fast', taken(f'fast {number}'), 0.1 * number)
        queue.submit('other', taken(f'other {number}'), 0.1 * number)
        handled.append(queue.take().item)
    assert handled + items(queue) == ['slow', 'fast 1', 'other 2', 'fast 3', 'other 3']


def test_requests_are_not_dropped_and_take_turns_with_cameras():
    queue, handled = FrameQueue(), []
    for number in range(3):
        queue.request(taken(f'request {number}'))
    for number in range(3):
        queue.submit('camera', taken(f'frame {number}'), 0.1 * number)
        handled += [queue.take().item, queue.take().item]
    assert handled == ['request 0', 'frame 0', 'request 1', 'frame 1', 'request 2', 'frame 2']
    for number in range(3):
        queue.request(taken(number))
    assert items(queue) == [0, 1, 2]


def test_a_part_begins_if_it_ends_before_the_next_frame_is_expected():
    queue = queue_of(0.0, 0.1, 0.2)
    assert queue.goes_on(NextPart(0.05), 0.24)
    assert not queue.goes_on(NextPart(0.05), 0.26)
    assert queue.goes_on(None, 0.26)


def test_no_frame_is_expected_of_a_camera_that_became_silent_or_sent_a_single_one():
    queue = queue_of(0.0, 0.1, 0.2)
    assert not queue.goes_on(LONG, 0.2 + 0.99 * LATE * 0.1)
    assert queue.goes_on(LONG, 0.2 + 1.01 * LATE * 0.1)
    assert queue_of(0.0).goes_on(LONG, 0.05)


def test_an_owed_part_is_searched_even_if_an_item_waits():
    queue = queue_of(0.0, 0.1)
    queue.request(taken('request'))
    assert queue.goes_on(NextPart(0.5, owed=True), 0.1)


class Story:
    """A loop whose items note when they are begun; they wait where the gate is closed, and fail if they say so.

    All come at the same time by its clock, so that none is expected.

    Attributes:
        events: items, and their parts that were searched.
        parts: that each item announces.
        gate: what an item waits for before its first part; open at first.
        searching: set when an item has announced its last part.
    """

    def __init__(self, *parts):
        self.events, self.errors, self.parts = [], [], parts
        self.gate, self.begun, self.searching = threading.Event(), threading.Event(), threading.Event()
        self.gate.set()
        self.reported = threading.Event()
        self.loop = FrameLoop(self._report, clock=lambda: 0.0)

    def _report(self, error):
        self.errors.append(error)
        self.reported.set()

    def handle(self, item):
        self.events.append(item)
        self.begun.set()
        assert self.gate.wait(TIMEOUT)
        if item == 'fails':
            raise ValueError(item)
        for part in self.parts:
            yield part
            self.events.append((item, part))
        self.searching.set()

    def answer(self, item, answer):
        assert self.gate.wait(TIMEOUT)
        if item == 'fails':
            raise ValueError(item)
        answer.set_result(f'answer to {item}')
        yield from self.handle(item)

    def in_thread(self, item):
        """Send a request from a thread of its own; return the thread and the list that its outcome is added to."""
        outcome = []

        def ask():
            try:
                outcome.append(self.loop.request(item, self.answer))
            except (StoppedError, ValueError) as error:
                outcome.append(error)

        thread = threading.Thread(target=ask)
        thread.start()
        return thread, outcome


def test_a_request_is_answered_before_its_search():
    story = Story(SHORT)
    assert story.loop.request('image', story.answer) == 'answer to image'
    assert story.searching.wait(TIMEOUT)
    assert story.loop.call(lambda: 'done between two items') == 'done between two items'
    story.loop.stop()
    assert story.events == ['image', ('image', SHORT)]


def test_an_error_after_the_answer_and_one_of_a_frame_are_reported_and_the_loop_goes_on():
    story = Story()

    def answer_and_fail(item, answer):
        answer.set_result(item)
        raise ValueError('after the answer')

    assert story.loop.request('image', answer_and_fail) == 'image'
    assert story.reported.wait(TIMEOUT)
    story.reported.clear()
    story.loop.submit('camera', 'fails', story.handle)
    assert story.reported.wait(TIMEOUT)
    story.loop.submit('camera', 'good', story.handle)
    assert story.searching.wait(TIMEOUT)
    story.loop.stop()
    assert [str(error) for error in story.errors] == ['after the answer', 'fails']
    assert story.events == ['fails', 'good']


def test_stop_ends_the_search_and_refuses_requests_that_wait_or_come_later():
    story = Story(NextPart(0.1, owed=True))
    story.gate.clear()
    story.loop.submit('camera', 'frame', story.handle)
    assert story.begun.wait(TIMEOUT)
    story.loop.submit('other', 'never begun', story.handle)
    thread, outcome = story.in_thread('image')
    wait_for(lambda: story.loop._queue._requests)
    stopping = threading.Thread(target=story.loop.stop)
    stopping.start()
    wait_for(lambda: story.loop._worker.stopped)
    story.gate.set()
    for each in (stopping, thread):
        each.join(TIMEOUT)
        assert not each.is_alive()
    assert isinstance(outcome[0], StoppedError)
    with pytest.raises(StoppedError, match='shutting down'):
        story.loop.call(list)
    assert story.events == ['frame']
    assert story.errors == []
