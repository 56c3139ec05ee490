"""Programs that pages of the docs show."""
import re
from pathlib import Path
from typing import Dict, List

DOCS = Path(__file__).resolve().parents[2] / 'docs'
_NAME = {'python': r"rospy\.init_node\('(\w+)'\)", 'cpp': r'ros::init\(argc, argv, "(\w+)"\)'}


def blocks(page: str, language: str) -> List[str]:
    """Return all blocks of code of a page in a language, such as 'cmake'."""
    return re.findall(rf'^```{language}\n(.*?)^```', (DOCS / page).read_text(), re.MULTILINE | re.DOTALL)


def programs(page: str, language: str) -> Dict[str, str]:
    """Return the programs of a page in 'python' or 'cpp', by the names of their nodes."""
    return {re.search(_NAME[language], code)[1]: code for code in blocks(page, language)}
