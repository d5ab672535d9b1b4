"""The vehicle built in code is shared with the tests of its dynamics."""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[1] / "dynamics"))
