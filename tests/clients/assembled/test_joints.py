from math import inf

from cellwright.clients.assembled.joints import JointInfo, index_table


def test_index_table_aligns_columns_and_omits_infinite_limits() -> None:
    table = index_table(
        [
            JointInfo(0, "a_long_name", "revolute", "arm", "base", -1.5, 1.5, 10.0, 2.0, True),
            JointInfo(1, "wheel", "continuous", "wheel", "arm", -inf, inf, inf, inf, True),
            JointInfo(2, "tip", "fixed", "tip", "wheel", -inf, inf, inf, inf, False),
        ]
    )
    assert table == (
        "index  joint        type        link   parent link  from  to\n"
        "0      a_long_name  revolute    arm    base         -1.5  1.5\n"
        "1      wheel        continuous  wheel  arm\n"
        "2      tip          fixed       tip    wheel"
    )
