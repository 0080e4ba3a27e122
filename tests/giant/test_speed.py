"""The script that times the files works, on a small project."""

import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[2] / "benches" / "giant_files.py"


def test_the_times_of_the_files_are_measured():
    size = ["--strips", "2", "--photos", "3", "--points", "20"]
    done = subprocess.run([sys.executable, SCRIPT, *size], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert "processors, Python" in lines[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    assert rows[0][:6] == ["object space", "COMMON", "CAMERAS", "IMAGES", "FRAMES", "GROUND"]
    spaces = [row[0] for row in rows[2:]]
    assert spaces == ["rectangular", "geographic", "geographic, every point in GROUND"]
    for row in rows[2:]:
        assert (row[1], row[2], row[4]) == ("2", "1", "12")  # two records for each of six stations
        assert all(int(count) > 12 for count in (row[3], row[5]))
        assert float(row[9]) > 0
