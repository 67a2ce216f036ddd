"""Does an effect keep the rules of the catalogue? The same checks for the program's own effects and for a user's."""

from .checks import Finding, check_effect, check_effects
from .compile_check import blamed, load_effects, load_file, try_laws

__all__ = ["Finding", "blamed", "check_effect", "check_effects", "load_effects", "load_file", "try_laws"]
