"""Who else sends what only we may: where sent frames come back, and where they do not."""

from __future__ import annotations

import pytest

from drivers.can.claims import Claims, writing_to

BEAT, ORDER, REQUEST = 0x77F, 0x201, 0x601


def claims(*, comes_back: bool) -> Claims:
    """Return claims after a drive has been set up with thirty requests."""
    made = Claims()
    for _ in range(30):
        made.sent(REQUEST)
        if comes_back:
            made.heard(REQUEST)
    made.claim((BEAT, ORDER))
    return made


@pytest.mark.parametrize("comes_back", [False, True])
def test_the_first_frame_of_somebody_else_is_told(comes_back: bool) -> None:
    made = claims(comes_back=comes_back)
    for _ in range(1000):
        for cob_id in (BEAT, ORDER):
            made.sent(cob_id)
            assert made.intruded() is None  # one of ours may be on its way back
            if comes_back:
                made.heard(cob_id)
            assert made.intruded() is None
    made.heard(ORDER)
    assert made.intruded() == ORDER


def test_who_was_there_before_us_is_told_when_we_claim() -> None:
    made = Claims()
    made.heard(BEAT)
    made.claim((BEAT, ORDER))
    assert made.intruded() == BEAT


def test_a_few_foreign_requests_are_not_taken_for_an_echo() -> None:
    made = Claims()
    for number in range(30):
        made.sent(REQUEST)
        if number < 10:
            made.heard(REQUEST)  # another program reads the drive, too
    made.claim((BEAT,))
    made.sent(BEAT)
    made.heard(BEAT)
    assert made.intruded() == BEAT


def test_what_was_not_claimed_is_anybodys() -> None:
    made = claims(comes_back=False)
    made.heard(0x182)
    assert made.intruded() is None


READ, WRITE = bytes.fromhex("4041600000000000"), bytes.fromhex("2385600001000000")


@pytest.mark.parametrize("comes_back", [False, True])
def test_others_may_read_the_drive_and_not_write_to_it(comes_back: bool) -> None:
    made = Claims()
    for data in (READ, WRITE) * 15:
        made.sent(REQUEST, data)
        if comes_back:
            made.heard(REQUEST, data)
    made.claim((BEAT, writing_to(1)))
    made.heard(REQUEST, READ)
    made.heard(REQUEST + 1, WRITE)  # to another drive
    made.heard(REQUEST, b"")
    assert made.intruded() is None
    made.heard(REQUEST, WRITE)
    assert made.intruded() == writing_to(1)
