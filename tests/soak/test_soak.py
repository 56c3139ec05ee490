"""The soak benchmark for three minutes with its start: all that goes on in an hour, in shorter periods."""
import subprocess

from development import ROOT


def test_soak():
    subprocess.run([str(ROOT / 'run'), 'bench', 'soak', '--minutes', '2.5'], check=True)
