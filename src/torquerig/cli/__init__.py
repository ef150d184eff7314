"""The command line: `torquerig run`, `sim`, `nodes`, `stop`, `reset`, `sdo`, `config`."""

from torquerig.cli.app import main

__all__ = ["main"]
