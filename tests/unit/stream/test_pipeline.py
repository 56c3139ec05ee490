"""The pipeline works on the newest item, overlaps its stages, keeps the order and survives what an item does to it."""
import threading
import time
from collections import Counter

from openpose_ros_pkg.stream.fair_lock import FairLock
from openpose_ros_pkg.stream.pipeline import Pipeline, PipelineStages

TIMEOUT = 30.0


def wait_for(condition):
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.001)


class Story:
    """A pipeline whose stages note what they do, and wait where a gate is closed.

    Attributes:
        events: (stage, item) as they begin.
        began: times at which these were, time.monotonic() [s].
        seconds: spent in each stage so far.
        gates: one for each stage; open at first.
        wanted: what tells the newest search whether another item waits or will come.
    """

    STAGES = ('prepare', 'compute', 'finish', 'search', 'follow_up')

    def __init__(self, lock=None, lead=0.0, **durations):
        self.wanted = None
        self.events, self.errors, self.began, self.seconds = [], [], {}, Counter()
        self.gates = {stage: threading.Event() for stage in self.STAGES}
        for gate in self.gates.values():
            gate.set()
        self._durations = durations
        self.pipeline = Pipeline(PipelineStages(*(self._stage(stage) for stage in self.gates)), self.errors.append,
                                 lock or FairLock(), lead)

    def _stage(self, stage):
        def work(item, wanted=None):
            self.wanted = wanted or self.wanted
            begin = self.began[stage, item] = time.monotonic()
            self.events.append((stage, item))
            time.sleep(self._durations.get(stage, 0.0))
            self.seconds[stage] += time.monotonic() - begin
            assert self.gates[stage].wait(TIMEOUT)
            if item == f'fails in {stage}':
                raise ValueError(item)
            return item
        return work

    def submit(self, *items):
        for item in items:
            self.pipeline.submit(item)

    def begun(self, stage, item):
        wait_for(lambda: (stage, item) in self.events)

    def items(self, stage):
        return [item for name, item in self.events.copy() if name == stage]


def test_stages_overlap():
    """While one item is computed, the next is prepared and the last one finished."""
    story = Story()
    story.gates['finish'].clear()
    story.submit('a')
    story.begun('finish', 'a')
    story.gates['compute'].clear()
    for item, stage in (('b', 'compute'), ('c', 'prepare')):
        story.submit(item)
        story.begun(stage, item)
    assert ('compute', 'c') not in story.events
    story.gates['compute'].set()
    story.gates['finish'].set()
    story.begun('finish', 'c')
    assert story.items('finish') == ['a', 'b', 'c']
    story.pipeline.stop()


def test_the_newest_wins_even_when_an_older_one_is_prepared():
    story = Story()
    story.gates['compute'].clear()
    story.submit('a')
    story.begun('compute', 'a')
    for item in 'bcd':
        story.submit(item)
        story.begun('prepare', item)
    wait_for(lambda: story.pipeline.replaced == 2)
    story.gates['compute'].set()
    story.begun('finish', 'd')
    story.pipeline.stop()
    assert story.items('compute') == ['a', 'd']
    assert story.pipeline.replaced == 2


def test_an_item_that_fails_does_not_stop_the_others():
    story = Story()
    for stage in ('prepare', 'compute', 'finish'):
        story.submit(f'fails in {stage}')
        wait_for(lambda stage=stage: [str(e) for e in story.errors][-1:] == [f'fails in {stage}'])
        story.submit(f'good after {stage}')
        story.begun('finish', f'good after {stage}')
    story.pipeline.stop()
    assert len(story.errors) == 3
    assert ('compute', 'fails in prepare') not in story.events
    assert ('finish', 'fails in compute') not in story.events


def test_while_others_compute_the_item_stays_the_newest():
    """The lock is held elsewhere: what waits for it is replaced, as the newest is taken when the turn comes."""
    lock = FairLock()
    story = Story(lock)
    with lock:
        for item in 'abc':
            story.submit(item)
            story.begun('prepare', item)
        wait_for(lambda: story.pipeline.replaced == 2)
        assert story.items('compute') == []
    story.begun('finish', 'c')
    story.pipeline.stop()
    assert story.items('compute') == ['c'] and story.pipeline.replaced == 2


def test_what_is_on_its_way_elsewhere_is_computed_in_any_case():
    """With a lead, one item is sent ahead and no other replaces it; of those behind it, the newest wins."""
    story = Story(lead=0.01)
    story.gates['compute'].clear()
    story.submit('a')
    story.begun('compute', 'a')
    story.submit('b')
    story.begun('prepare', 'b')
    for item in 'cd':
        story.submit(item)
        time.sleep(0.02)
    assert story.items('prepare') == ['a', 'b']
    story.gates['compute'].set()
    story.begun('finish', 'd')
    story.pipeline.stop()
    assert story.items('prepare') == story.items('compute') == story.items('finish') == ['a', 'b', 'd']


def test_an_item_is_searched_once_it_is_finished_until_the_next_one_comes():
    story = Story()
    for stage in ('finish', 'search', 'follow_up'):
        story.gates[stage].clear()
    story.submit('a')
    story.begun('finish', 'a')
    assert story.items('search') == []
    story.gates['finish'].set()
    story.begun('follow_up', 'a')  # the search does not wait for it
    story.begun('search', 'a')
    assert not story.wanted(0.0)
    story.gates['prepare'].clear()
    story.submit('b')
    story.begun('prepare', 'b')
    assert story.wanted(0.0)
    for gate in story.gates.values():
        gate.set()
    story.begun('search', 'b')
    story.pipeline.stop()
    assert story.items('compute') == story.items('search') == ['a', 'b']


def test_a_search_is_offered_between_items_that_follow_each_other_closely_and_ends_where_others_compute():
    lock = FairLock()
    story = Story(lock)
    story.gates['compute'].clear()
    story.submit('a')
    story.begun('compute', 'a')
    story.submit('b')
    story.begun('prepare', 'b')
    story.gates['finish'].clear()
    story.gates['search'].clear()
    story.gates['compute'].set()
    story.begun('search', 'a')  # though it is not finished
    assert story.wanted(0.0)
    story.gates['search'].set()
    story.gates['finish'].set()
    story.begun('search', 'b')
    story.gates['search'].clear()
    story.submit('c')
    story.begun('search', 'c')
    assert not story.wanted(0.0)
    other = threading.Thread(target=lambda: (lock.acquire(), lock.release()))
    other.start()
    wait_for(lambda: story.wanted(0.0))
    story.gates['search'].set()
    other.join(TIMEOUT)
    story.pipeline.stop()


def test_a_search_is_told_when_the_next_item_is_to_be_expected():
    story = Story(prepare=0.0)
    begin = time.monotonic()
    for number in range(5):
        wait_for(lambda number=number: time.monotonic() >= begin + 0.2 * number)
        story.submit(number)
    story.begun('search', 4)
    assert story.wanted(0.3)
    wait_for(lambda: time.monotonic() >= begin + 1.3)  # no item came: no other one is expected
    assert not story.wanted(0.3)
    story.pipeline.stop()
