"""Programs that take turns on one connection to a cell."""

import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.agents.kitter.turns import Turns
from cellwright.clients.client.client import Client
from cellwright.clients.client.in_process import InProcess
from cellwright.config.trial.trial import Trial
from cellwright.engine.loop import StopCondition
from cellwright.util.errors import RunEndedError, UsageError


def turns(count: int = 2, deadline: float | None = None) -> Turns:
    stop = StopCondition() if deadline is None else StopCondition(round(deadline * 1e9), "enough")
    return Turns(InProcess(Cell(Trial("empty")), stop=stop), count)


def test_programs_work_in_their_order_and_time_passes_when_all_wait() -> None:
    table, seen = turns(), []

    def program(name: str, client: Client, pause: float) -> None:
        for _ in range(3):
            seen.append((name, round(client.time, 3)))
            client.sleep(pause)

    one, two = table.clients
    table.run([lambda: program("one", one, 0.2), lambda: program("two", two, 0.3)])
    assert seen == [("one", 0.0), ("two", 0.0), ("one", 0.2), ("two", 0.3), ("one", 0.4), ("two", 0.6)]


def test_condition_is_met_by_what_another_program_does() -> None:
    table = turns()
    done: list[bool] = []
    one, two = table.clients

    def first() -> tuple[bool, float]:
        return one.wait_until(lambda: bool(done), 5.0), round(one.time, 3)

    def second() -> tuple[bool, float]:
        two.sleep(0.5)
        done.append(True)
        return two.wait_until(lambda: False, 0.2), round(two.time, 3)

    assert table.run([first, second]) == [(True, 0.502), (False, 0.7)]


def test_each_program_gets_messages_of_its_own_subscriptions_until_it_is_closed() -> None:
    table = turns()
    counts = [each.latest("/clock") for each in table.clients]
    table.run([lambda each=each: each.sleep(0.1) for each in table.clients])  # type: ignore[misc]
    assert [each.count for each in counts] == [50, 50]
    table.close()
    table._transport.advance(200_000_000)
    assert [each.count for each in counts] == [50, 50]


def test_error_of_a_program_ends_the_others_and_is_raised() -> None:
    table, ends = turns(), []
    one, two = table.clients

    def first() -> None:
        one.sleep(0.1)
        raise UsageError("no way")

    def second() -> None:
        try:
            two.sleep(9.0)
        finally:
            ends.append(round(two.time, 3))

    with pytest.raises(UsageError, match="no way"):
        table.run([first, second])
    assert ends == [0.1]


def test_end_of_run_ends_all_programs() -> None:
    table, ends = turns(deadline=0.3), []

    def program(client: Client) -> None:
        try:
            client.sleep(9.0)
        except RunEndedError as error:
            ends.append(str(error))
            raise

    with pytest.raises(RunEndedError, match="enough"):
        table.run([lambda each=each: program(each) for each in table.clients])  # type: ignore[misc]
    assert ends == ["enough", "enough"]
