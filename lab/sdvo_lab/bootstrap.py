"""Intervals by bootstrap."""
import random


def mean(values):
    return sum(values) / len(values)


def interval(values, draws=5000):
    """The 95 % percentile interval of the mean over drives; not a number for less than two."""
    if len(values) < 2:
        return float("nan"), float("nan")
    generator = random.Random(1)
    means = sorted(mean(generator.choices(values, k=len(values))) for _ in range(draws))
    return means[round(0.025 * (draws - 1))], means[round(0.975 * (draws - 1))]
