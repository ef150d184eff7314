"""The driver's error tree."""

import pickle

import pytest

from torquerig.driver import errors
from torquerig.driver.errors import TorqueRigError
from torquerig.driver.wire.sdo import AbortCode, SdoAbort


@pytest.mark.parametrize(
    ("error", "builtin"),
    [
        (errors.BusError, OSError),
        (errors.BusUrlError, ValueError),
        (errors.EdsError, ValueError),
        (errors.ProfileError, ValueError),
        (SdoAbort, RuntimeError),
        (errors.NoAnswer, TimeoutError),
        (errors.SecondMaster, RuntimeError),
        (errors.DriveFault, errors.DriveError),
        (errors.ConfigurationMismatch, RuntimeError),
        (errors.EnablingRefused, RuntimeError),
        (errors.NotHomed, RuntimeError),
    ],
)
def test_every_leaf_is_also_the_builtin_that_fits(error, builtin):
    assert issubclass(error, TorqueRigError)
    assert issubclass(error, builtin)


def test_a_message_is_shown_as_it_stands():
    assert str(errors.BusError("the link is gone")) == "the link is gone"
    assert str(errors.NoAnswer("node 3 is silent")) == "node 3 is silent"


def test_an_sdo_abort_says_object_reason_and_code_and_survives_pickling():
    abort = pickle.loads(pickle.dumps(SdoAbort(AbortCode.READ_ONLY, 0x6041, 0)))  # noqa: S301
    assert str(abort) == "SDO transfer of 6041:0 aborted: attempt to write a read-only object (0x06010002)"
    assert (abort.code, abort.index, abort.subindex) == (AbortCode.READ_ONLY, 0x6041, 0)


def test_an_sdo_abort_without_object_or_known_code_still_reads():
    assert str(SdoAbort(0x12345678)) == "SDO transfer aborted: unknown reason (0x12345678)"
