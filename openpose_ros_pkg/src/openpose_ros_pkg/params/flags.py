"""Parameters as flags of a command line in the notation of gflags, as in the original."""
import dataclasses
import difflib
from typing import Any, Callable, Dict, Iterator, List, Sequence, Tuple, Type

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.params.parameters import accepted_names, describe, parameter_fields

# Flags and parameters of the original's nodes.
_OF_THE_ORIGINAL = ('logging_level', 'camera_topic', 'net_input_width', 'net_input_height', 'net_output_width',
                    'net_output_height', 'output_width', 'output_height', 'num_scales', 'scale_gap', 'num_gpu_start',
                    'model_folder', 'pose_model', 'alpha_pose', 'disable_blending')
# Texts that gflags.cc takes for a bool.
_BOOLS = {**dict.fromkeys(('true', 't', 'yes', 'y', '1'), True), **dict.fromkeys(('false', 'f', 'no', 'n', '0'), False)}


def read_flags(kind: Type[Any], arguments: Sequence[str]) -> Tuple[Dict[str, Any], List[str]]:
    """Return the parameters that flags set, and the names of flags that only other nodes of the original have.

    --NAME=VALUE or --NAME VALUE; for bools --NAME and --noNAME, and no VALUE after a space. One dash equals two; the
    last of equal flags holds.

    Args:
        kind: parameter class or record of the node.
        arguments: of the command line, without those of ROS.

    Raises:
        ParameterError: an argument is no flag, has an unknown name, or no value of the right type.
    """
    fields = {field.name: field for field in parameter_fields(kind)}
    values: Dict[str, Any] = {}
    others: List[str] = []
    rest = iter(arguments)
    for argument in rest:
        name, equals, text = argument.lstrip('-').partition('=')
        if not argument.startswith('-') or not name:
            raise ParameterError(f"argument '{argument}' is not allowed; expected --NAME=VALUE or _NAME:=VALUE")
        if name in fields and isinstance(fields[name].default, bool):
            values[name] = _converted(fields[name], text if equals else 'true')
        elif name in fields:
            values[name] = _converted(fields[name], text if equals else _following(argument, rest))
        elif name[:2] == 'no' and name[2:] in fields and isinstance(fields[name[2:]].default, bool) and not equals:
            values[name[2:]] = False
        elif name in accepted_names(kind):
            values[name] = text if equals else _following(argument, rest)
        elif name in _OF_THE_ORIGINAL:
            if not equals and name != 'disable_blending':
                _following(argument, rest)
            others.append(name)
        else:
            near = ''.join(f" (did you mean '--{other}'?)" for other in difflib.get_close_matches(name, fields, n=1))
            raise ParameterError(f"unknown flag '{argument.partition('=')[0]}'{near}; --help lists the parameters")
    return values, others


def _following(argument: str, rest: Iterator[str]) -> str:
    """Return the next argument, which is the value of this one."""
    value = next(rest, None)
    if value is None:
        raise ParameterError(f"flag '{argument}' has no value; expected {argument}=VALUE")
    return value


def _converted(field: 'dataclasses.Field[Any]', text: str) -> Any:
    """Return the value of a text in the parameter's type; `build` checks its range."""
    kind: Callable[[str], Any] = type(field.default)
    try:
        return _BOOLS[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise ParameterError(f"parameter '{field.name}' = '{text}' is not allowed: {describe(field)}") from None
