"""The rigs of the statistics, which `long_run.py` uses too, stand beside the tests."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
