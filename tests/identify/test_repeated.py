"""Hops that were held out: what is not predicted is said, with its bound."""

from dataclasses import replace

from legbench.identify.repeated import HopFigures, Repeated

HOP = HopFigures(rating_stance=0.99, rating_flight=0.98, rise=0.03, hop_freq=2.0)


def test_a_hop_within_all_bounds_misses_nothing() -> None:
    near = replace(HOP, rating_flight=0.9701, rise=0.0297003, hop_freq=2.0059)
    assert Repeated(run="hop", measured=HOP, predicted=near).good


def test_every_figure_that_is_not_predicted_is_named() -> None:
    far = HopFigures(rating_stance=0.97, rating_flight=float("nan"), rise=0.0283, hop_freq=2.01)
    found = Repeated(run="hop", measured=HOP, predicted=far)
    assert not found.good
    assert found.misses == (
        "P^r stance is off by 0.020, more than 0.01",
        "P^r flight is off by nan, more than 0.01",
        "rise by flight time is off by 5.67%, more than 1.0%",
        "frequency is off by 0.50%, more than 0.3%",
    )
