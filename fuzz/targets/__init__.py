"""The targets: one reader each.

A module of this package has:

- `attempt(data)`, which gives bytes to a reader and raises on a finding;
- `seeds()`, the first inputs of the search;
- `WORDS`, the reader's keywords;
- `mutate(data, chance)`, where random bytes get nowhere: it changes an input so that it stays of its kind.

`MAX_SIZE` is the largest input [bytes].
"""
