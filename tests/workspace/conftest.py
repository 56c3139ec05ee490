"""What the tests of builds share."""
import pytest

from workspaces import plain_environment


@pytest.fixture(scope='module')
def environment(tmp_path_factory):
    return plain_environment(tmp_path_factory)
