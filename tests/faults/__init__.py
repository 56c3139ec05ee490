"""Faults that are injected into the real nodes; what a case is says fault.py, how they are run rig.py."""
