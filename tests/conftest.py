"""Compiled modules are kept whatever the environment says: hundreds of processes that tests start load them."""

import os
import sys

os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False
