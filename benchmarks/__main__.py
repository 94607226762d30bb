"""Run benchmarks: all of them, or those named; numbers and --options are theirs.

`--help` tells what they measure and how they are called.
"""

import os
import sys
from importlib import import_module
from pkgutil import iter_modules

import benchmarks

# as in the program: threads only wait for each other, and waiting is processor time
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
available = [m.name for m in iter_modules(benchmarks.__path__) if m.name[0] != "_"]
named = [word for word in sys.argv[1:] if word[0] != "-" and not word.isdigit()]
wanted = named or available
if unknown := set(wanted) - set(available):
    sys.exit(f"no benchmark {', '.join(sorted(unknown))}; there are {available}")
for name in wanted:
    module = import_module(f"benchmarks.{name}")
    if "--help" in sys.argv[1:]:
        print(f"{name}: {module.__doc__}")
        continue
    print(f"== {name}", flush=True)
    module.main()
