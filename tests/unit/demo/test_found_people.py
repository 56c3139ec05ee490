"""The count of the demo, on outputs made by hand: people 1 and 2 stand 2 m apart for four frames of 0.1 s."""
import pytest

from development.demo.found_people import Output, count_found

LEFT, RIGHT = (-1.0, 0.0, 3.0), (1.0, 0.0, 3.0)
HIDDEN = [2] * 8 + [3] * 10
BOTH = {7: LEFT, 8: RIGHT}


def truth(*hidden):
    """Both people in four frames; the one on the right is hidden in some."""
    return {'joints': ['nose', 'neck'], 'frames': [
        {'people': [{'id': 1, 'xyz': [None, LEFT], 'vis': [2] * 9 + [1] * 9},
                    {'id': 2, 'xyz': [None, RIGHT], 'vis': HIDDEN if frame in hidden else [2] * 18}]}
        for frame in range(4)]}


def played(*necks, frames=(0, 1, 2, 3, 0, 1, 2, 3)):
    """Outputs with these people; two seconds are black between two passes."""
    return [Output(frame, 0.1 * number + 2.0 * (number > 3), people)
            for number, (frame, people) in enumerate(zip(frames, necks))]


def test_all_are_found_without_a_gap():
    assert count_found([], truth()) == (0, 0, 0.0, 0, [], set())
    assert count_found(played(*[BOTH] * 8), truth()) == (16, 16, 0.0, 0, [{7, 8}, {7, 8}], set())


def test_a_gap_lasts_until_the_person_is_found():
    count = count_found(played(BOTH, {7: LEFT}, {7: LEFT, 8: (1.0, 0.0, 3.7)}, BOTH), truth())
    assert (count.visible, count.found, count.no_person) == (8, 6, 0)  # 0.7 m off: neither found nor no person
    assert count.longest_gap == pytest.approx(0.2)


def test_black_ends_a_gap():
    count = count_found(played(BOTH, BOTH, BOTH, {7: LEFT}, {7: LEFT}, BOTH), truth())
    assert (count.visible, count.found) == (12, 10)
    assert count.longest_gap == pytest.approx(0.1)  # the first frame after it


def test_a_hidden_person_need_not_be_found():
    count = count_found(played(BOTH, {7: LEFT}, {7: LEFT}, BOTH), truth(1, 2))
    assert (count.visible, count.found, count.longest_gap) == (6, 6, 0.0)


@pytest.mark.parametrize('between, gap', [({7: LEFT}, 0.2), (BOTH, 0.1)])
def test_time_in_which_a_person_is_hidden_adds_nothing_to_a_gap(between, gap):
    count = count_found(played({7: LEFT}, between, {7: LEFT}, BOTH), truth(1))
    assert (count.visible, count.found) == (7, 5)
    assert count.longest_gap == pytest.approx(gap)


def test_people_where_there_are_none_are_counted_each_time():
    ghost = {9: (0.0, 0.0, 3.0)}
    count = count_found(played({**BOTH, **ghost}, {**BOTH, **ghost}, BOTH, BOTH), truth())
    assert (count.found, count.no_person, count.ids) == (8, 2, [{7, 8, 9}])


def test_exchanged_ids_are_told_from_new_ones():
    new, swapped = {9: LEFT, 8: RIGHT}, {8: LEFT, 7: RIGHT}
    count = count_found(played(*[BOTH] * 4, *[new] * 4), truth())
    assert (count.ids, count.exchanged) == ([{7, 8}, {8, 9}], set())
    count = count_found(played(*[BOTH] * 4, *[swapped] * 4), truth())
    assert (count.found, count.exchanged) == (16, {7, 8})


def test_a_pass_begins_with_an_earlier_frame_whichever_are_missing():
    count = count_found(played({7: LEFT}, {8: LEFT}, {9: LEFT}, frames=(1, 3, 3)), truth())
    assert count.ids == [{7, 8}, {9}]
