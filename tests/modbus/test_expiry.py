"""When a file of certificates ends: a chain with the first of its links, several CAs with the last of them."""

import pytest

from gateway.modbus.certificate import PeerCertificate
from gateway.modbus.expiry import day_of, end_of


def shown(name: str, ends: str, signed_by: str = "", number: str = "01") -> PeerCertificate:
    return PeerCertificate(name, None, number, "2020", ends, name.encode(), (signed_by or name).encode())


@pytest.mark.parametrize(
    ("ca", "ends"),
    [
        ([], ""),
        ([shown("one", "2030")], "2030"),
        ([shown("old", "2026"), shown("new", "2036")], "2036"),
        ([shown("root", "2040"), shown("cells", "2026", "root")], "2026"),
        ([shown("cells", "2036", "root"), shown("root", "2030")], "2030"),
        ([shown("root", "2040"), shown("cells", "2026", "root"), shown("new cells", "2028", "root")], "2028"),
        ([shown("root", "2040"), shown("middle", "2027", "root"), shown("cells", "2035", "middle")], "2027"),
        ([shown("root", "2030"), shown("root", "2040"), shown("cells", "2036", "root")], "2036"),
        ([shown("cells", "2030", "a root elsewhere")], "2030"),
        ([shown("a", "2030", "b"), shown("b", "2029", "a")], "2029"),
        ([shown("other", "2040"), shown("root", "2035"), shown("cells", "2030", "root")], "2040"),
        (
            [shown("root", "2040", number="01"), shown("root", "2030", number="02"), shown("cells", "2036", "root")],
            "2036",
        ),
    ],
)
def test_a_ca_that_another_of_its_file_has_signed_ends_with_the_chain(ca: list[PeerCertificate], ends: str) -> None:
    """Of a root of 2040 and the CA of the cells of 2026 nothing was told before 2040: in 2026 no client connected."""
    assert end_of("ca", ca) == end_of("ca", ca[::-1]) == ends


@pytest.mark.parametrize(
    ("own", "ends"),
    [
        ([], ""),
        ([shown("gateway", "2027", "cells"), shown("cells", "2026")], "2027"),
        ([shown("gateway", "2027", "cells"), shown("other", "2025", "root")], "2027"),
        ([shown("gateway", "2027", "cells"), shown("cells", "2026", "root")], "2026"),
        (
            [shown("gateway", "2027", "cells"), shown("cells", "2028", "middle"), shown("middle", "2025", "root")],
            "2025",
        ),
        ([shown("gateway", "2027")], "2027"),
    ],
)
def test_the_gateway_s_own_ends_with_those_between_it_and_the_root(own: list[PeerCertificate], ends: str) -> None:
    """A root's copy does not count, every client has its own; of one between, which only we send, nothing was told."""
    assert end_of("certificate", own) == ends


def test_a_day_is_told_as_people_write_it() -> None:
    assert day_of("20261203040506Z") == "2026-12-03"
