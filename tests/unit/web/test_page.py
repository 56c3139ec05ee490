"""The page in a headless Chromium: it draws what the messages of a server say."""
import json
import re
import threading
import time

import cv2
import numpy as np
import pytest

from browser import Browser, chromium
from development import PACKAGES
from openpose_ros_pkg.networks.models import default_model_folder
from openpose_ros_web import three_js
from openpose_ros_web.protocol import encode
from openpose_ros_web.server import Key, PeopleServer

PACKAGE = PACKAGES['openpose_ros_web']
WWW = PACKAGE / 'www'
MESSAGES = [json.loads(line) for line in (PACKAGE / 'test/messages.jsonl').read_text().splitlines()]
HELLO = MESSAGES[0]
CAMERAS = next(message for message in MESSAGES if message['type'] == 'cameras')
MEASURED, INFERRED = 1, 2
HOSTILE = '<img src=x onerror="document.title=1"><script>document.title=2</script>'

needs_browser = pytest.mark.skipif(chromium() is None, reason='chromium is not installed: apt-get install chromium')


def frame(people, gestures):
    """Return messages of a frame of the recording with so many people and a gesture: people and signals."""
    signals = next(message for message in MESSAGES if message['type'] == 'signals' and len(message['people']) == people
                   and any(person['gestures'] for person in message['people']) == gestures)
    return next(message for message in MESSAGES if message['type'] == 'people'
                and message['stamp'] == signals['stamp']), signals


class Site:
    """A server with the page, which sends the state each second; `start` uses its port again."""

    def __init__(self):
        self.port = 0
        self.state = next(message for message in MESSAGES if message['type'] == 'state')
        self.ended = threading.Event()
        self.start()
        threading.Thread(target=self.beat, daemon=True).start()

    def beat(self):
        while not self.ended.wait(1.0):
            self.send(self.state)

    def stop(self):
        self.ended.set()
        self.server.stop()

    def start(self):
        self.server = PeopleServer('localhost', self.port, {'/': WWW, '/vendor/': three_js.three_folder()}, HELLO)
        self.port = self.server.port

    def send(self, *messages):
        for message in messages:
            if message['type'] == 'state':
                self.state = message
            clock = {'time': time.time()} if 'time' in message else {}
            self.server.publish(Key(message['type']), encode({**message, **clock}), keep=True)


@pytest.fixture(scope='module')
def site():
    site = Site()
    yield site
    site.stop()


@pytest.fixture(scope='module')
def browser(site):
    with Browser() as browser:
        browser.open(f'http://localhost:{site.port}/')
        browser.wait('Boolean(window.peopleView?.messages.hello)')
        yield browser


@pytest.fixture(autouse=True)
def no_complaints(request):
    if 'browser' not in request.fixturenames:
        yield
        return
    browser = request.getfixturevalue('browser')
    yield
    browser.run('1')  # takes what has come meanwhile
    complaints, browser.errors = browser.errors, []
    assert complaints == []


def shown(site, browser, *messages):
    """Send messages and wait until they are drawn."""
    site.send(CAMERAS, *messages)
    people = next(message for message in messages if message['type'] == 'people')
    ids = [person['id'] for person in people['people']]
    browser.wait(f'''peopleView.messages.people?.stamp === {people["stamp"]} &&
                 peopleView.messages.signals?.stamp === {people["stamp"]} &&
                 JSON.stringify(peopleView.messages.people.people.map(each => each.id)) === "{encode(ids)}"''')
    browser.wait_for_drawing()


def table(browser):
    return browser.run('[...document.querySelectorAll("#people tr")].map(row => [...row.cells].map('
                       'cell => cell.textContent))')


def picture_of(browser):
    return cv2.imdecode(np.frombuffer(browser.screenshot(), np.uint8), cv2.IMREAD_COLOR)[:, :, ::-1].astype(int)


def hue(rgb):
    return float(cv2.cvtColor(np.uint8([[rgb]]), cv2.COLOR_RGB2HSV)[0, 0, 0]) * 2


def hue_difference(first, second):
    return abs((hue(first) - hue(second) + 180) % 360 - 180)


def expected_pixels(browser, camera, people):
    """Return where the joints are in the view from a camera: {(id, joint): (u, v)}, by the camera's own model."""
    left, top, width, height = browser.run(
        '(r => [r.left, r.top, r.width, r.height])(document.getElementById("scene").getBoundingClientRect())')
    fx, fy, cx, cy = camera['K']
    rotation, position = np.reshape(camera['rotation'], (3, 3)), np.array(camera['position'])
    scale = min(width / camera['size'][0], height / camera['size'][1])
    pixels = {}
    for person in people['people']:
        local = (np.reshape(person['xyz'], (-1, 3)) - position) @ rotation
        for joint, (x, y, z), status in zip(HELLO['skeletons'][people['skeleton']]['joints'], local, person['status']):
            if status:
                pixels[person['id'], joint] = (
                    left + width / 2 + scale * (fx * x / z + cx - camera['size'][0] / 2),
                    top + height / 2 + scale * (fy * y / z + cy - camera['size'][1] / 2))
    return pixels


@needs_browser
def test_before_the_first_message_the_page_waits_and_says_so():
    site = Site()
    with Browser() as browser:
        browser.open(f'http://localhost:{site.port}')
        browser.wait('document.getElementById("notice")?.textContent === "waiting for the first message"')
        assert browser.run('document.getElementById("none").offsetHeight') == 0, 'it is not known that there are none'
        shown(site, browser, *frame(2, True))
        browser.wait('document.getElementById("notice").hidden')
        size = browser.run('parseFloat(getComputedStyle(document.querySelector("#labels .person")).fontSize)')
        assert size >= 30, 'read at two metres: capitals of 5 mm on a screen of 0.22 mm per pixel'
    site.stop()


@needs_browser
@pytest.mark.parametrize('index', range(len(CAMERAS['cameras'])))
def test_people_are_drawn_where_the_messages_say(site, browser, index):
    people, signals = frame(3, False)
    shown(site, browser, people, signals)
    browser.press(str(index + 1))
    browser.wait(f'peopleView.view.mode === "camera {index}"')
    browser.wait_for_drawing()
    joints = browser.run('peopleView.joints()')
    expected = expected_pixels(browser, CAMERAS['cameras'][index], people)
    found = {(joint['id'], joint['joint']): (joint['x'], joint['y']) for joint in joints}
    assert found.keys() == expected.keys()
    for key, pixel in expected.items():
        assert found[key] == pytest.approx(pixel, abs=1.0), key


@needs_browser
def test_drawn_pixels_have_the_colours_of_the_people(site, browser):
    """Joints may be behind others and labels: most show the person's hue, and those around none."""
    people, signals = frame(2, True)
    shown(site, browser, people, signals)
    browser.press('1')
    browser.run('["labels", "velocity", "pointing"].forEach(name => peopleView.settings.set(name, false))')
    browser.wait_for_drawing()
    picture = picture_of(browser)
    joints = browser.run('peopleView.joints()')
    browser.run('["labels", "velocity", "pointing"].forEach(name => peopleView.settings.set(name, true))')
    colours = {person['id']: person['rgb'] for person in people['people']}
    for number, rgb in colours.items():
        pixels = [picture[round(joint['y']), round(joint['x'])] for joint in joints
                  if joint['id'] == number and joint['status'] == MEASURED]
        right = [hue_difference(pixel, rgb) < 12 and pixel.max() > 80 for pixel in pixels]
        assert len(right) > 4
        assert np.mean(right) > 0.8, (number, pixels)


@needs_browser
def test_table_and_labels_say_what_the_messages_say(site, browser):
    people, signals = frame(2, True)
    shown(site, browser, people, signals)
    rows = table(browser)
    assert [row[0] for row in rows] == [str(person['id']) for person in people['people']]
    by_id = {str(person['id']): person for person in signals['people']}
    for name, distance, posture, gesture in rows:
        assert re.fullmatch(r'\d\.\d m', distance)
        assert posture == by_id[name]['posture'].replace('unknown', '')
        assert [each['name'] in gesture for each in by_id[name]['gestures']] == [True] * len(by_id[name]['gestures'])
    labels = browser.run('[...document.querySelectorAll("#labels .person")].map(each => each.textContent)')
    gesture = next(each['name'] for person in signals['people'] for each in person['gestures'])
    assert any(gesture in label for label in labels)
    assert {label.split('\n')[0] for label in labels} == set(by_id)


@needs_browser
def test_names_never_become_markup(site, browser):
    people, signals = frame(2, True)
    person = {**signals['people'][0], 'posture': HOSTILE,
              'gestures': [{'name': HOSTILE, 'arm': HOSTILE, 'seconds': 1.0}]}
    state = next(message for message in MESSAGES if message['type'] == 'state')
    node = {'name': HOSTILE, 'level': 7, 'text': HOSTILE}
    site.send({**state, 'nodes': [node]}, {**HELLO, 'cameras': [HOSTILE, 'b', 'c']})
    shown(site, browser, people, {**signals, 'people': [person]})
    browser.wait('document.getElementById("nodes").textContent.includes("onerror")')
    assert any('onerror' in cell for row in table(browser) for cell in row)
    assert browser.run('document.querySelectorAll("img, body script").length') == 0
    assert browser.run('document.title') == 'People'
    site.send(HELLO)
    browser.wait('peopleView.messages.hello.cameras[0] === "camera_0"')


@needs_browser
def test_a_phone(site, browser):
    people, signals = frame(3, False)
    shown(site, browser, people, signals)
    width = 390
    browser.resize(width, 780, phone=True)
    browser.wait(f'document.getElementById("scene").clientWidth === {width}')
    browser.run('peopleView.state.setLink("lost", "no connection, trying again")')
    browser.run('document.getElementById("figures").textContent = "14.8 Hz · 120 ms"')
    assert browser.run('document.documentElement.scrollWidth') == width, 'nothing is beside the screen'
    assert browser.run('document.querySelector("header").offsetHeight') < 60, 'one line'
    browser.run('peopleView.state.setLink("live", "connected")')
    browser.resize(1280, 800)


@needs_browser
def test_people_are_faded_when_no_message_comes(site, browser):
    people, signals = frame(3, False)
    shown(site, browser, people, signals)
    assert not browser.run('document.body.classList.contains("old")')
    browser.wait('document.body.classList.contains("old")')
    told = browser.run('document.getElementById("notice").textContent')
    assert re.fullmatch(r'last seen \d+ s ago', told)
    assert browser.run('getComputedStyle(document.getElementById("scene")).opacity') == '0.35'
    shown(site, browser, *frame(2, True))
    browser.wait('document.body.classList.contains("old") === false')
    assert browser.run('document.getElementById("notice").hidden')


@needs_browser
def test_connects_again_after_the_server_was_gone(site, browser):
    people, signals = frame(2, True)
    shown(site, browser, people, signals)
    site.server.stop()
    browser.wait('document.getElementById("link").className === "lost"')
    site.start()
    browser.wait('document.getElementById("link").className === "live"')
    other = frame(3, False)
    shown(site, browser, *other)
    assert len(table(browser)) == 3
    browser.errors = [error for error in browser.errors if 'WebSocket' not in error and 'ERR_CONNECTION' not in error]


def wait_for(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def test_three_js_is_compared_with_its_checksums(tmp_path, monkeypatch, capsys):
    kept = three_js.three_folder()
    monkeypatch.setenv('OPENPOSE_ROS_CACHE', str(tmp_path))
    assert three_js.main(['--check']) == 1
    assert 'rosrun openpose_ros_web fetch_three' in capsys.readouterr().err
    folder = default_model_folder().parent / kept.name
    folder.mkdir(parents=True)
    for path in kept.iterdir():
        (folder / path.name).write_bytes(path.read_bytes())
    assert three_js.main(['--check']) == 0
    with (folder / 'OrbitControls.js').open('a') as handle:
        handle.write('// changed')
    assert three_js.main(['--check']) == 1
