"""The targets: one reader each.

A module of this package has `attempt(data)`, which takes bytes to a reader and raises when it finds something;
`seeds()`, what the search begins with; `WORDS`, what the reader knows; and, where random bytes get nowhere,
`mutate(data, chance)`, which changes an input so that it stays of its kind. `LONGEST` is the largest input [bytes].
"""
