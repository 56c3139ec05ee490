"""Natural order of file names: image2 before image10."""
import re
from pathlib import Path
from typing import Any, List


def natural_key(path: Path) -> List[Any]:
    """Return a key that sorts numbers in names by their value, and is never equal for two names."""
    return [[int(part) if i % 2 else part for i, part in enumerate(re.split(r'(\d+)', path.name.lower()))], path.name]
