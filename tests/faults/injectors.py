"""What cases inject, where more than one needs it."""
import tempfile
from pathlib import Path
from typing import Any, Callable, Dict

Injector = Callable[[Any], None]


def changed(part: str, **fields: Any) -> Injector:
    """Return what sends a frame of which a message, 'image', 'points' or 'info', has other values in these fields."""
    def change(frame: Any) -> None:
        for name, value in fields.items():
            setattr(getattr(frame, part), name, value)
    return altered(change)


def altered(change: Callable[[Any], None]) -> Injector:
    """Return what sends a frame after a function changed its messages."""
    def inject(chain: Any) -> None:
        frame = chain.frame()
        change(frame)
        chain.send(frame)
    return inject


def refused(program: str, parameters: Dict[str, Any], *words: str, text: str = '') -> Callable[[Any], None]:
    """Return what starts a program with these parameters, which has to end with 1 and these words.

    Args:
        text: of a file that is written; {file} in a parameter is its path.
    """
    def run(rig: Any) -> None:
        from faults.rig import Program, says_when_it_ends
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / 'settings.yaml'
            path.write_text(text)
            # a name of its own, as the parameter server keeps what a node was given
            says_when_it_ends(rig, f'refused/node_{abs(hash((program, words)))}', Program(program, {
                name: str(value).format(file=path) for name, value in parameters.items()}), *words)
    return run
