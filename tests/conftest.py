"""Property tests: no time limit on an example (the first one may compile), and the same examples in every automatic run."""

from __future__ import annotations

import os

from hypothesis import settings

settings.register_profile("levelone", deadline=None, derandomize=bool(os.environ.get("CI")))
settings.load_profile("levelone")
