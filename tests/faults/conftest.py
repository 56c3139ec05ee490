"""The nodes that all faults share."""
from typing import Any, Iterator

import pytest


@pytest.fixture(scope='session')
def rig(request: Any, tmp_path_factory: Any) -> Iterator[Any]:
    from faults.rig import Rig
    from session import Session
    with Session(tmp_path_factory.mktemp('log')) as session:
        parameters = [getattr(item, 'callspec', None) and item.callspec.params for item in request.session.items]
        yield Rig(session, [each['fault'] for each in parameters if each and 'fault' in each])
