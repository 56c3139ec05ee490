"""The page with a recording inside, in a headless Chromium without any server: it shows and plays what is recorded."""
import json
from pathlib import Path

import numpy as np
import pytest

from browser import Browser, chromium
from development import PACKAGES
from long_recording import SITS, WAVES, long_recording
from openpose_ros_pkg.errors import BadInputError, ModelError
from openpose_ros_tools.report.recording import facts_of, frames_of
from openpose_ros_web import three_js
from openpose_ros_web.protocol import encode
from openpose_ros_web.recorded_page import recorded_page

WWW = PACKAGES['openpose_ros_web'] / 'www'
HOSTILE = '=</script><img src=x onerror="document.title=1">&quot;'
SECONDS = 40.0

needs_browser = pytest.mark.skipif(chromium() is None, reason='chromium is not installed: apt-get install chromium')


def page_of(recording):
    return recorded_page(recording.name, facts_of(recording), frames_of(recording), WWW, three_js.three_folder())


@pytest.fixture(scope='module')
def recording():
    return long_recording(SECONDS, name=HOSTILE, word=HOSTILE)


@pytest.fixture(scope='module')
def browser(recording, tmp_path_factory):
    path: Path = tmp_path_factory.mktemp('page') / 'people.html'
    path.write_text(page_of(recording), encoding='utf-8')
    with Browser() as browser:
        browser.open(path.as_uri())
        browser.wait('Boolean(window.peopleView?.player)')
        yield browser


@needs_browser
def test_it_shows_the_frame_of_each_time(browser, recording):
    frames = [[json.loads(encode(message)) for message in frame] for frame in frames_of(recording)]
    for time in (0.0, 14.0, 39.0, SITS + 0.5, 1000.0):
        browser.run(f'peopleView.player.seek({time})')
        index = min(int(time * 15 + 1e-6), len(frames) - 1)
        signals, people = frames[index]
        assert browser.run('peopleView.state.messages.people.people') == people['people']
        assert browser.run('peopleView.state.messages.signals.stamp') == signals['stamp']
        ids = browser.wait('[...document.querySelectorAll("#people tr button")].map(each => each.textContent)')
        assert ids == ['1', '2', '3']
    assert browser.errors == []


@needs_browser
def test_it_plays_and_keys_move_the_time(browser):
    browser.run('peopleView.player.seek(2)')
    browser.run('document.getElementById("speed").value = 4')
    browser.press(' ')
    browser.wait('peopleView.player.time', lambda time: time > 3)
    browser.press(' ')
    assert browser.run('document.getElementById("play").textContent') == 'Play'
    browser.run('peopleView.player.seek(10)')
    browser.press('ArrowRight')
    assert browser.run('peopleView.player.time') == pytest.approx(11)
    browser.press('.')
    assert browser.run('peopleView.player.time') == pytest.approx(11 + 1 / 15, abs=1e-3)
    browser.run("""(() => { const track = document.querySelector('.person .track'), box = track.getBoundingClientRect()
        track.dispatchEvent(new MouseEvent('click', {clientX: box.left + box.width / 2, bubbles: true})) })()""")
    assert browser.run('peopleView.player.time') == pytest.approx((SECONDS - 1 / 15) / 2, abs=0.1)
    # the end stops it, and play begins anew
    browser.run('peopleView.player.seek(1000)')
    browser.press(' ')
    browser.wait('peopleView.player.time', lambda time: 0 < time < 30)
    browser.press(' ')
    assert browser.errors == []


@needs_browser
def test_the_timeline_has_the_spans_of_each_person(browser):
    spans = browser.run("""[...document.querySelectorAll('.row.person')].map(row =>
        [...row.querySelectorAll('.gesture')].map(each => [each.style.left, each.style.width].map(parseFloat)))""")
    end = SECONDS - 1 / 15
    assert np.allclose(spans, [[[100 * begin / end, 100 * (SITS - WAVES) / end] for begin in (WAVES, WAVES + 20)]] * 3,
                       atol=0.02)
    assert browser.run("document.querySelectorAll('.plot img').length") == 4
    browser.run("document.querySelectorAll('.plot').forEach(each => { each.open = true })")
    browser.wait("[...document.querySelectorAll('.plot img')].every(each => each.naturalWidth > 0)")


@needs_browser
def test_nothing_in_a_recording_is_markup_or_leaves_the_page(browser):
    assert browser.run('document.title') == HOSTILE
    assert browser.run("document.querySelector('.gesture').textContent") == HOSTILE.lower()
    assert HOSTILE in browser.run("document.getElementById('link').textContent")
    assert browser.run("document.querySelectorAll('img[src=x], img[onerror]').length") == 0
    used = browser.run("performance.getEntriesByType('resource').map(each => each.name.slice(0, 5))")
    assert {*used} <= {'data:', 'blob:'}


def test_a_minute_of_three_people_has_little_more_than_a_megabyte():
    """Beside 1.1 MB of the page and three.js."""
    assert len(page_of(long_recording(60.0))) - len(page_of(long_recording(1.0))) < 1_400_000


def test_missing_files_are_named(tmp_path, monkeypatch):
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))
    with pytest.raises(ModelError, match='rosrun openpose_ros_web fetch_three'):
        three_js.three_folder()
    with pytest.raises(BadInputError, match=r'the page lacks a file: .*main\.js'):
        recorded_page('', {}, [], tmp_path, tmp_path)
