"""Definitions of messages in bags, made harmless: rosbag generates code from them and runs it, from any source.

genmsg checks the names of fields only. `int32 a; import os; b=1` would be run, and the value of a bool is
evaluated.
"""
import re

from openpose_ros_pkg.errors import BadInputError

_NAME = r'[A-Za-z]\w*'
TYPE_NAME = rf'{_NAME}(?:/{_NAME})?'
"""Regular expression of the name of a type."""

# Arrays of a fixed length are filled when a message is made; covariances have 36 numbers.
_HARMLESS = re.compile(rf'={{80}}|MSG: *{TYPE_NAME}|{TYPE_NAME}(?:\[\d{{0,4}}\])? +{_NAME}|'
                       rf'{_NAME} +{_NAME} *= *[-+.\w]+', re.ASCII)
_STRING_CONSTANT = re.compile(rf'string +({_NAME}) *=(.*)', re.ASCII)


def harmless_definition(text: str) -> str:
    """Return a definition without its comments, and without constants of type string that hold quotes or backslashes.

    Raises:
        BadInputError: a line is neither a field nor a constant, nor the beginning of a type.
    """
    lines = []
    for line in text.replace('\t', ' ').splitlines():
        bare = line.partition('#')[0].strip()
        constant = _STRING_CONSTANT.fullmatch(line.strip())
        if constant is not None:  # its value has no comments
            if not set(constant[2]) & set('\'"\\'):
                lines.append(f'string {constant[1]}={constant[2]}\n')
        elif bare:
            if not _HARMLESS.fullmatch(bare):
                raise BadInputError(f'a definition of messages in the bag has a line that is no field: {line[:100]!r}')
            lines.append(f'{bare}\n')
    return ''.join(lines)
