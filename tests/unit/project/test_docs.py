"""Links of the pages lead somewhere, images are used, and the pages stay short."""
import re
from pathlib import Path

import pytest

from openpose_ros_pkg.params.launch_arguments import declared_arguments, listing

ROOT = Path(__file__).parents[3]
PAGES = [ROOT / 'README.md', ROOT / 'CONTRIBUTING.md', *sorted((ROOT / 'docs').glob('*.md'))]
NOTES = sorted((ROOT / 'development/notes').glob('*.md'))
LINK = re.compile(r'\]\((?!https?:)([^)#\s]*)#?([^)\s]*)\)')


def prose(page):
    """Return the text of a page without its code."""
    return re.sub(r'^```.*?^```$|`[^`\n]*`', '', page.read_text(), flags=re.MULTILINE | re.DOTALL)


def anchors(page):
    """Return the anchors that GitHub gives the headings of a page."""
    headings = re.findall(r'^#+ (.*)$', re.sub(r'^```.*?^```$', '', page.read_text(), flags=re.MULTILINE | re.DOTALL),
                          re.MULTILINE)
    return {re.sub(r'[^\w\- ]', '', heading.lower()).replace(' ', '-') for heading in headings}


@pytest.mark.parametrize('page', [*PAGES, *NOTES], ids=lambda page: page.name)
def test_links_lead_to_files_and_headings(page):
    for path, anchor in LINK.findall(prose(page)):
        target = (page.parent / path).resolve() if path else page
        assert target.exists(), f'{page.name}: {path}'
        assert not anchor or anchor in anchors(target), f'{page.name}: {path}#{anchor}'


def test_each_page_is_reached_and_each_image_is_shown():
    text = ''.join(page.read_text() for page in PAGES)
    for page in PAGES[2:]:
        assert f'{page.name})' in text or f'{page.name}#' in text, page.name
    for image in [path for path in (ROOT / 'docs/images').iterdir() if path.suffix not in ('.py', '.sh')]:
        assert image.name in text, f'no page shows {image.name}'


def test_the_pages_are_read_in_an_hour():
    words = {page.name: len(page.read_text().split()) for page in PAGES if page.name != 'CONTRIBUTING.md'}
    assert words['README.md'] <= 900
    assert sum(words.values()) <= 22000, words


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_no_command_needs_ros_in_the_place_of_one_system(page):
    """On Debian it is in /usr; what is sourced is the workspace."""
    assert not re.findall(r'source /opt/ros\S+', page.read_text())


def launch_arguments(path):
    """Return the arguments that a launch file accepts: those of the files that it has checked."""
    command = re.search(r'/check_arguments (.*?)"', path.read_text(), re.DOTALL)[1]
    return set(declared_arguments([LAUNCH_FILES[name] for name in re.findall(r'\w+\.launch', command)]))


def test_arguments_of_launch_files_are_listed():
    """All that can be given, and no helper."""
    for path in LAUNCH_FILES.values():
        listed = re.findall(r'^  (\w+):=', listing(path), re.MULTILINE)
        assert len(listed) == len(set(listed)) > 2, path
        assert '/check_arguments' not in path.read_text() or set(listed) == launch_arguments(path), path
    people = listing(LAUNCH_FILES['people.launch'])
    assert people.startswith('  camera:=          kinect2, realsense')
    assert '\n  signals:=         tell what people do (true)\n' in people
    assert len(people.splitlines()) <= 20


LAUNCH_FILES = {path.name: path for parent in ('.', 'extensions') for path in (ROOT / parent).glob('*/launch/*.launch')}
COMMAND = re.compile(r'(?:run launch|roslaunch) (\w+) (\w+\.launch)((?: +\w+:=\S+)*)')


@pytest.mark.parametrize('page', PAGES, ids=lambda page: page.name)
def test_launch_files_and_their_arguments_exist(page):
    commands = COMMAND.findall(re.sub(r'\\\n *', ' ', page.read_text()))
    for package, name, arguments in commands:
        if package.startswith(('openpose_ros', 'skeleton_extract')):
            assert LAUNCH_FILES[name].parents[1].name == package
            assert set(re.findall(r'(\w+):=', arguments)) <= launch_arguments(LAUNCH_FILES[name]), (name, arguments)
