"""Plant parameters that explain the thesis' sixteen errors best: `torquerig fit-plant`."""
