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
    fair_share,
    small_grey,
    strips,
)

WIDTH, HEIGHT = 960, 540
LEFT, MIDDLE, RIGHT = (Part(0, *columns, WIDTH) for columns in strips(WIDTH, 3))


def done_at(*stamps):
    schedule = Schedule((LEFT, MIDDLE, RIGHT))
    for part, stamp in zip(schedule.parts, stamps):
        schedule = schedule.done(part, stamp)
    return schedule


def test_where_a_person_was_lost_is_searched_first():
    schedule = done_at(0.0, 0.1, 0.2).lost([np.array([[RIGHT.right - 10, 0], [RIGHT.right, 200]])])
    assert schedule.order(0.3) == [RIGHT, LEFT, MIDDLE]
    assert schedule.done(RIGHT, 0.3).order(0.4) == [LEFT, MIDDLE, RIGHT]
    assert schedule.order(-0.1)[0] == RIGHT  # an image that comes late


def test_where_the_image_changed_is_searched_sooner_but_others_are_not_forgotten():
    schedule = done_at(0.0, 0.0, 0.0)
    searched = []
    for frame in range(1, 13):
        schedule = schedule.changed(np.full(SCHEDULE.grey_pixels, WIDTH - 1.0))  # a screen, say
        part = schedule.order(0.1 * frame)[0]
        schedule = schedule.done(part, 0.1 * frame)
        searched.append(part)
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


def test_a_slow_camera_leaves_more_time_and_left_out_frames_do_not():
    slow, losing = Budget.of_rate(30.0), Budget.of_rate(30.0)
    for interval in (0.1, 0.1, 0.1):
        slow = slow.begun(interval)
    for interval in (0.1, 1 / 30, 0.1):
        losing = losing.begun(interval)
    assert slow.crops(0.01) == round((1 - SCHEDULE.search_share) * SCHEDULE.followed_share * 10)
    assert losing.crops(0.01) == round((1 - SCHEDULE.search_share) * SCHEDULE.followed_share * 10 / 3)


@pytest.mark.parametrize('wanted, shares', [
    ([1.0, 1.0], [0.5, 0.5]), ([3.0, 1.0], [0.5, 0.5]), ([0.1, 1.0], [0.1, 0.9]), ([0.1, 2.0, 0.6], [0.1, 0.45, 0.45]),
    ([0.1, 0.3], [0.25, 0.75]), ([0.0, 0.0], [0.5, 0.5]), ([0.0, 1.0], [0.0, 1.0])])
def test_a_small_demand_is_met_and_the_others_share_the_rest(wanted, shares):
    for number, share in enumerate(shares):
        others = wanted[:number] + wanted[number + 1:]
        assert fair_share(wanted[number], *others) == pytest.approx(share)
    assert sum(shares) == pytest.approx(1.0)
