"""How long it takes from the command to the first painted sweep, off-screen, caches warm.

python benchmarks/startup.py
python benchmarks/startup.py harbour --runs 9
"""

import argparse
import os
import statistics
import subprocess
import sys
import time

MARK = "first sweep painted"
TOO_LONG = 120.0  # s


def start(source: str) -> float:
    """Seconds from the start of the process until it says that the sweep is on the screen."""
    environment = os.environ | {"QT_QPA_PLATFORM": "offscreen"}
    command = [sys.executable, "-m", "radar_console", source, "--verbose"]
    began = time.monotonic()
    with subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        try:
            for line in process.stderr:
                if MARK in line:
                    return time.monotonic() - began
                if time.monotonic() - began > TOO_LONG:
                    break
        finally:
            process.terminate()
    raise SystemExit(f"{source}: no sweep was painted")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("source", nargs="?", default="twenty-five")
    parser.add_argument("--runs", type=int, default=5, help="after one that is not counted")
    arguments = parser.parse_args()
    start(arguments.source)
    times = [start(arguments.source) for _ in range(arguments.runs)]
    print(f"{arguments.source}: first sweep after {statistics.median(times):.2f} s, median of {len(times)}")
    print(f"fastest {min(times):.2f} s, slowest {max(times):.2f} s")


if __name__ == "__main__":
    main()
