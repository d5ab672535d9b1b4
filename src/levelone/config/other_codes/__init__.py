"""Readers of what other codes print: DUST integral loads, VSPAERO ``.stab`` and AVL ``st`` files.

What they hold is turned into this package's names, signs and normalisation; what cannot be is named, with the reason.
"""

from levelone.config.other_codes.avl import read_st
from levelone.config.other_codes.dust import Loads, read_loads
from levelone.config.other_codes.other_code import OtherCode
from levelone.config.other_codes.vspaero import read_stab, read_stab_conditions

__all__ = ["Loads", "OtherCode", "read_loads", "read_st", "read_stab", "read_stab_conditions"]
