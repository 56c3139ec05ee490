"""Parameter classes, their YAML files, and changes while a node runs."""
