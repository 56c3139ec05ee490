"""Message classes of packages that are not part of this project, and may be absent where it runs."""
import importlib
from typing import Mapping, NamedTuple, Type

import genpy

from openpose_ros_pkg.errors import ForeignPackageError


class ForeignPackage(NamedTuple):
    """A package of messages that is looked for when a node starts."""

    name: str  # of the package
    source: str  # where its sources are

    def message(self, name: str, fields: Mapping[str, str]) -> Type[genpy.Message]:
        """Return the class of a message with these fields, types as `rosmsg show` has them.

        Raises:
            ForeignPackageError: package or message is not found, or a field is missing or of another type.
        """
        try:
            kind = getattr(importlib.import_module(f'{self.name}.msg'), name)
        except ImportError as error:
            raise ForeignPackageError(
                f'the messages of the package {self.name} are not found ({error}). On Ubuntu: sudo apt install '
                f"ros-$ROS_DISTRO-{self.name.replace('_', '-')}. Where there is no such package, build it in a "
                f'workspace, of {self.source}, and source its setup.bash before this starts') from error
        except AttributeError as error:
            raise ForeignPackageError(f'the package {self.name} has no message {name}: take the release for ROS 1 of '
                                      f'{self.source}') from error
        found = dict(zip(kind.__slots__, kind._slot_types))
        wrong = [f"{field} is {found.get(field, 'missing')}, not {wanted}" for field, wanted in fields.items()
                 if found.get(field) != wanted]
        if wrong:
            raise ForeignPackageError(f"{self.name}/{name} is defined otherwise than known here: {'; '.join(wrong)}. "
                                      f'Take the release for ROS 1 of {self.source}')
        return kind
