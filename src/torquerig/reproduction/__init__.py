"""The thesis reproduced end to end over the wire: all its experiments, tables, figures, findings and misprints."""
