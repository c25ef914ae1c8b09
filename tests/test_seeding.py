import numpy as np

from perpetua.seeding import StageSeed, stream


def test_stream_depends_on_every_name() -> None:
    names: list[tuple[int, int, str, str | int]] = [
        (0, 0, "a", "x"), (1, 0, "a", "x"), (0, 1, "a", "x"), (0, 0, "b", "x"), (0, 0, "a", "y"), (0, 0, "a", 0),
    ]  # fmt: skip
    firsts = {int(stream(*name).integers(2**62)) for name in names}
    assert len(firsts) == len(names)


def test_names_do_not_run_together() -> None:
    assert stream(0, 0, "a", "b", "c").integers(2**62) != stream(0, 0, "a", "bc").integers(2**62)
    assert stream(1, 10, "a").integers(2**62) != stream(11, 0, "a").integers(2**62)


def test_stream_is_the_same_on_every_machine_and_release() -> None:
    # A change of these numbers changes every data set ever made: it must never happen unnoticed.
    drawn = stream(7, 2, "routes", "walk", 3).integers(0, 1000, 4)
    np.testing.assert_array_equal(drawn, StageSeed(7, 2, "routes").stream("walk", 3).integers(0, 1000, 4))
    np.testing.assert_array_equal(drawn, [661, 867, 292, 249])
