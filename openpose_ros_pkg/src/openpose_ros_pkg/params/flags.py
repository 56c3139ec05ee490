"""Parameters as flags of a command line in the notation of gflags, as in the original."""
import dataclasses
import difflib
from typing import Any, Callable, Dict, List, Sequence, Tuple, Type

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
    bools = {'disable_blending', *(name for name, field in fields.items() if isinstance(field.default, bool))}
    values: Dict[str, Any] = {}
    others: List[str] = []
    rest = iter(arguments)
    for argument in rest:
        name, equals, text = argument.lstrip('-').partition('=')
        if not argument.startswith('-') or not name:
            raise ParameterError(f"argument '{argument}' is not allowed; expected --NAME=VALUE or _NAME:=VALUE")
        if not equals and name not in fields and name[:2] == 'no' and name[2:] in bools:
            name, equals, text = name[2:], '=', 'false'
        if name not in (*fields, *accepted_names(kind), *_OF_THE_ORIGINAL):
            near = ''.join(f" (did you mean '--{other}'?)" for other in difflib.get_close_matches(name, fields, n=1))
            raise ParameterError(f"unknown flag '{argument.partition('=')[0]}'{near}; --help lists the parameters")
        if not equals:
            following = 'true' if name in bools else next(rest, None)
            if following is None:
                raise ParameterError(f"flag '{argument}' has no value; expected {argument}=VALUE")
            text = following
        if name in fields:
            values[name] = _converted(fields[name], text)
        elif name in accepted_names(kind):
            values[name] = text
        else:
            others.append(name)
    return values, others


def _converted(field: 'dataclasses.Field[Any]', text: str) -> Any:
    """Return the value of a text in the parameter's type; `build` checks its range."""
    kind: Callable[[str], Any] = type(field.default)
    try:
        return _BOOLS[text.lower()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise ParameterError(f"parameter '{field.name}' = '{text}' is not allowed: {describe(field)}") from None
