"""What things cost, measured: each figure a ratio, or taken beside what it is compared with, in one run."""
