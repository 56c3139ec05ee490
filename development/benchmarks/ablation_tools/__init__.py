"""What the programs of `ablation/` share: variants of constants, changes of figures, what is counted."""
import common  # noqa: F401 - finds the packages
