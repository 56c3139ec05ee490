"""What ./run does, once there is Python: python3 development COMMAND ARGS."""
import sys
from pathlib import Path

sys.path[0] = str(Path(__file__).resolve().parents[1])

from development.commands import main  # noqa: E402

if __name__ == '__main__':
    main(sys.argv[1:])
