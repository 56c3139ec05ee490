"""Step 1 of the set-up: installs what the system lacks, with apt."""
import os
import shlex
import shutil
import subprocess
from typing import List, Sequence

from development.systems import needed_packages, this_system
from development.terminal import die, say, step

APT = ['env', 'DEBIAN_FRONTEND=noninteractive', 'apt-get', '--yes', '--no-install-recommends',
       '-o', 'DPkg::Lock::Timeout=900', '-o', 'Dpkg::Use-Pty=0', '-o', 'Dpkg::Options::=--force-confdef',
       '-o', 'Dpkg::Options::=--force-confold']


def set_up_system_packages() -> None:
    missing = missing_packages()
    if not missing:
        say('[1/4] System packages: all there')
        return
    step(f'[1/4] System packages: installing {len(missing)} and what these need', 'packages',
         'check the network and the sources of apt (on Ubuntu, universe is needed)',
         install, missing, as_root(missing))
    missing = missing_packages()
    if missing:
        die(f'apt-get reported success, but these packages are still missing: {" ".join(missing)}')


def missing_packages() -> List[str]:
    shown = subprocess.run(['dpkg-query', '--show', '--showformat', '${db:Status-Abbrev}${Package}\n'],
                           stdout=subprocess.PIPE, text=True, check=True).stdout
    installed = {line[3:] for line in shown.splitlines() if line[1:3] == 'i '}
    return sorted(needed_packages(this_system()) - installed)


def as_root(packages: Sequence[str]) -> List[str]:
    """Return what comes in front of a command to run it as root; ask for the password if that is needed."""
    if os.getuid() == 0:
        return []
    names = shlex.join(packages)
    if shutil.which('sudo') is None:
        die('system packages are missing and there is no sudo; do this once as root, then run ./run setup again:\n'
            f'  apt-get update && apt-get install --no-install-recommends {names}')
    if (subprocess.run(['sudo', '-n', 'true'], stderr=subprocess.DEVNULL, check=False).returncode != 0
            and subprocess.run(['sudo', '-v'], check=False).returncode != 0):
        die(f'this user may not install system packages with sudo: {names}')
    return ['sudo', '-n']


def install(packages: Sequence[str], root: Sequence[str]) -> None:
    apt = [*root, *APT]
    subprocess.run([*root, 'dpkg', '--configure', '-a'], check=False)  # what an interrupted installation left
    simulated = subprocess.run(['apt-get', '--simulate', '--no-install-recommends', 'install', *packages],
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
    if simulated.returncode != 0:
        subprocess.run([*apt, 'update'], check=True)
    if subprocess.run([*apt, 'install', *packages], check=False).returncode != 0:
        # an old package list names files that are gone
        subprocess.run([*apt, 'update'], check=True)
        subprocess.run([*apt, '--fix-broken', 'install'], check=True)
        subprocess.run([*apt, 'install', *packages], check=True)
