"""What is searched when: all of the image in turn, sooner where something happens, within the time there is."""
import numpy as np
import pytest

from openpose_ros_pkg.detect.schedule import (
    NO_GREY,
    SCHEDULE,
    Budget,
    Part,
    Schedule,
    changed_columns,
    small_grey,
    strips,
)

WIDTH, HEIGHT = 960, 540
LEFT, MIDDLE, RIGHT = PARTS = [Part(0, *columns, WIDTH) for columns in strips(WIDTH, 3)]


def searched_at(*stamps):
    schedule = Schedule(tuple(PARTS))
    for part, stamp in zip(PARTS, stamps):
        schedule = schedule.done(part, stamp)
    return schedule


def order(schedule, stamp):
    """Return the parts in the order in which they are searched in an image."""
    parts = []
    while schedule.next(stamp) is not None:
        parts.append(schedule.next(stamp))
        schedule = schedule.done(parts[-1], stamp)
    return parts


def test_the_longest_wait_comes_first_and_each_part_once_in_an_image():
    assert order(searched_at(0.2, 0.0, 0.1), 0.3) == [MIDDLE, RIGHT, LEFT]
    assert order(searched_at(0.1, 0.0), 0.3)[0] == RIGHT  # never searched
    assert Schedule(()).next(1.0) is None
    assert order(searched_at(0.2, 0.0, 0.1), 0.15) == [MIDDLE, RIGHT]  # an image that comes late


def test_where_a_person_may_come_out_is_searched_first():
    schedule = searched_at(0.0, 0.1, 0.2).in_boxes([np.array([[RIGHT.right - 10, 0], [RIGHT.right, 200]])])
    assert order(schedule, 0.3) == [RIGHT, LEFT, MIDDLE]
    assert order(schedule.done(RIGHT, 0.3), 0.4) == [LEFT, MIDDLE, RIGHT]


def test_where_the_image_changed_is_searched_sooner_but_others_are_not_forgotten():
    schedule, searched = searched_at(0.0, 0.0, 0.0), []
    for frame in range(1, 13):
        schedule = schedule.changed(np.full(SCHEDULE.grey_pixels, WIDTH - 1.0))  # a screen, say
        searched.append(schedule.next(0.1 * frame))
        schedule = schedule.done(searched[-1], 0.1 * frame)
    assert searched[0] is RIGHT
    assert searched.count(RIGHT) > searched.count(LEFT) >= 2 and searched.count(MIDDLE) >= 2


def test_changes_are_those_outside_of_people_and_of_the_light():
    image = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    person = np.array([[90.0, 100.0], [190.0, 300.0]])
    first = small_grey(image)
    assert len(changed_columns(first, NO_GREY, (WIDTH, HEIGHT), [])) == 0
    assert len(changed_columns(small_grey(image + 20), first, (WIDTH, HEIGHT), [])) == 0
    moved = image + 20
    moved[120:280, 100:180] = 200
    assert len(changed_columns(small_grey(moved), first, (WIDTH, HEIGHT), [person])) == 0
    moved[200:300, 700:760] = 200
    columns = changed_columns(small_grey(moved), first, (WIDTH, HEIGHT), [person])
    assert len(columns) >= SCHEDULE.grey_pixels and columns.min() > 690 and columns.max() < 770


def shares(part, crops=0.0, cameras=1, interval=0.02, seconds=60.0, whole=1.0):
    """Return the shares of the time of searching parts that take some seconds: while no frame waits, and where one
    waits, after crops in each frame [s]. All of the image takes `whole` [s].
    """
    spent = []
    for allows in (Budget.affords, Budget.owes):
        budget, total = Budget(), 0.0
        for _ in range(round(seconds / interval)):
            budget = budget.after_frame(interval, crops, whole, cameras)
            while allows(budget, part):
                budget, total = budget.after_part(part), total + part
        spent.append(total / seconds)
    return spent


@pytest.mark.parametrize('part', [0.004, 0.1, 2.0])
def test_the_search_has_the_time_that_is_left_whatever_a_part_takes(part):
    """Also parts that take longer than an interval, or than can be saved."""
    free, owed = shares(part)
    assert free == pytest.approx(SCHEDULE.followed_share, abs=0.04)
    assert SCHEDULE.search_share - 0.04 < owed < free + 0.04


def test_crops_take_from_the_search_but_not_what_it_is_owed():
    """That is one search of all of the image in its time, but no more than its share."""
    assert shares(0.01, crops=0.007)[0] == pytest.approx(SCHEDULE.followed_share - 0.35, abs=0.01)
    assert shares(0.01, crops=0.5) == pytest.approx(2 * [SCHEDULE.search_share], abs=0.01)
    whole = 0.5 * SCHEDULE.search_share * SCHEDULE.search_time
    assert shares(whole / 9, crops=0.5, whole=whole)[1] == pytest.approx(0.5 * SCHEDULE.search_share, abs=0.01)


def test_cameras_share_the_time():
    assert 3 * np.array(shares(0.01, cameras=3)) == pytest.approx(shares(0.01), abs=0.02)


def test_no_more_is_saved_than_a_moment():
    budget = Budget()
    for _ in range(1000):
        budget = budget.after_frame(0.1, 0.0, 1.0, 1)
    assert budget.saved == budget.owed == SCHEDULE.most_saved
