"""The errors that this project raises for what a user can cause."""

# Of texts [characters]; the longest list of allowed parameters has 2,000.
_LONGEST = 4000


class OpenposeRosError(Exception):
    """Base of all errors below.

    Attributes:
        event: what a node counts when it drops a frame because of it; empty: it should not come with a frame.
    """

    event = ''

    def __str__(self) -> str:
        """Return the text; of a long one, as of a damaged file, its beginning and end."""
        text = super().__str__()
        return text if len(text) <= _LONGEST else f'{text[:_LONGEST - 600]} ... {text[-500:]}'


class ParameterError(OpenposeRosError):
    """A parameter is unknown, of the wrong type or out of range; the text names key, value and what is allowed.

    Attributes:
        key: name of the parameter; empty where it is not a single one.
    """

    def __init__(self, text: str, key: str = '') -> None:
        super().__init__(text)
        self.key = key


class ModelError(OpenposeRosError):
    """Weights are missing or damaged, or a network computes wrong results; the text says how to get out of it."""


class MissingWeightsError(ModelError):
    """Weights are not there; the text says how to get them."""


class ForeignPackageError(OpenposeRosError):
    """A package of another project is missing or has other messages than expected; the text says how to get it."""


class BadInputError(OpenposeRosError):
    """An image, depth image, cloud or message can not be used; the text names actual and expected value."""

    event = 'bad input'


class NoStampError(OpenposeRosError):
    """A message has no stamp: its time is not known."""

    event = 'stamp 0'


class ServiceCallError(OpenposeRosError):
    """The service did not answer this request; the next one may succeed."""

    event = 'service call failed'


class NoTransformError(OpenposeRosError):
    """tf has no transform between two frames at the time of a message."""

    event = 'no transform'


class StoppedError(OpenposeRosError):
    """A request came while the node is being ended."""

    event = 'shutting down'
