"""How many examples the fuzz tests take, and what they print at the end.

Without FUZZ_EXAMPLES each target gets 60, always the same ones, and one that fails is printed as it is. With it, each
target gets so many random ones; one that fails is made small first, and printed with a line that reproduces it.
"""
import os

from hypothesis import HealthCheck, Phase, settings

EXAMPLES = os.environ.get('FUZZ_EXAMPLES')
settings.register_profile('fuzz', max_examples=int(EXAMPLES or 60), derandomize=not EXAMPLES, print_blob=True,
                          deadline=None, database=None, suppress_health_check=list(HealthCheck),
                          phases=(Phase.explicit, Phase.generate, *((Phase.shrink,) if EXAMPLES else ())))
settings.load_profile('fuzz')
