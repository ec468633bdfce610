"""Run `iccbrdf apply` and print the most memory that it held, and the time that it took, as JSON.

python tools/measure_memory.py large.tif -p mid.icc -p mvis.icc -o xyz.tif
"""

# Nothing large is imported here: the peak of a child counts from the size that its parent has at the fork.
import json
import resource
import subprocess
import sys
import time


def main() -> None:
    command = [sys.executable, "-c", "from iccbrdf.cli import main; main()", "apply", *sys.argv[1:]]
    start = time.perf_counter()
    code = subprocess.run(command, stdout=sys.stderr).returncode
    seconds = time.perf_counter() - start
    # In bytes on macOS, in KiB elsewhere.
    unit = 1 if sys.platform == "darwin" else 1024
    peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * unit
    print(json.dumps({"peak_MB": round(peak / 1e6, 1), "seconds": round(seconds, 1)}))
    sys.exit(code)


if __name__ == "__main__":
    main()
