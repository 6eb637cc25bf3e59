"""Runs that were lost to the infrastructure: their line, and their number by trial."""

from cellwright.running.evaluation.results.infrastructure import InfrastructureLoss, loss_counts


def test_losses_are_counted_by_trial_in_their_order() -> None:
    lost = [InfrastructureLoss(trial, seed, "gone") for seed in (1, 2) for trial in ("b", "a")]
    assert list(loss_counts([*lost, InfrastructureLoss("a", 3, "gone")]).items()) == [("b", 2), ("a", 3)]
    assert lost[0].line == "b seed 1: gone"
