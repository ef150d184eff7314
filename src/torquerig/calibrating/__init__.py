"""Calibration on the application's side: what each procedure is made of, how it is conducted, what it leaves.

One module a procedure, each with an `OFFER`; `catalogue.PROCEDURES` knows them by name and imports them when called.
"""
