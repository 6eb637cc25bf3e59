"""Fakes of viser's handles: they keep their values, count changes, and can be used as by a browser."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import numpy as np

from cellwright.viewer.web.connection import ServerConnection


class FakeHandle:
    """Element of a page."""

    def __init__(self, kind: str, name: str, values: dict[str, Any]) -> None:
        self.__dict__.update(values)
        self.kind, self.name = kind, name
        self.callbacks: list[Callable[[Any], Any]] = []
        self.sets = 0
        self.is_removed = False
        self.frequency = 0.0

    def __setattr__(self, attribute: str, value: Any) -> None:
        before: Any = self.__dict__.get(attribute)
        if np.array_equal(before, value):  # as in viser, see test_widgets
            return
        self.__dict__[attribute] = value
        self.__dict__["sets"] = self.__dict__.get("sets", 0) + 1
        if attribute == "value":  # as in viser: setting it here calls the callbacks, without a browser
            self.use(None)

    def on_update(self, callback: Callable[[Any], Any]) -> None:
        """Keep the callback."""
        self.callbacks.append(callback)

    on_click = on_update

    def on_hold(self, callback: Callable[[Any], Any], callback_hz: float) -> None:
        """Keep the callback of a hold."""
        self.__dict__["frequency"] = callback_hz
        self.callbacks.append(callback)

    def use(self, client_id: int | None, phase: str = "", client: Any = None, **values: Any) -> None:
        """Use the element as a browser does."""
        self.__dict__.update(values)
        for callback in self.callbacks:
            found = callback(SimpleNamespace(client_id=client_id, client=client, target=self, phase=phase))
            if asyncio.iscoroutine(found):
                asyncio.run(found)

    def remove(self) -> None:
        """Remove the element."""
        self.__dict__["is_removed"] = True

    def __enter__(self) -> FakeHandle:
        return self

    def __exit__(self, *_: object) -> None:
        return None


class FakeGui:
    """Creates the elements of a panel."""

    def __init__(self) -> None:
        self.made: list[Any] = []

    def __getattr__(self, method: str) -> Callable[..., FakeHandle]:
        if not method.startswith("add_"):
            raise AttributeError(method)

        def add(name: str, options: Any = None, **values: Any) -> FakeHandle:
            first = {"value": values.pop("initial_value", None), "content": name, "label": name}
            handle = FakeHandle(
                method.removeprefix("add_"), name, {"visible": True, "disabled": False, **first, **values}
            )
            handle.__dict__["options"] = options
            self.made.append(handle)
            return handle

        return add

    def find(self, kind: str, name: str) -> Any:
        """Element of this name."""
        return next(each for each in self.made if (each.kind, each.name) == (kind, name))


class FakeScene(FakeGui):
    """Creates the nodes of a scene."""

    def __getattr__(self, method: str) -> Callable[..., FakeHandle]:
        add = super().__getattr__(method)

        def placed(name: str, text: str = "", **values: Any) -> FakeHandle:
            return add(name, text=text, position=np.zeros(3), wxyz=np.array([1.0, 0.0, 0.0, 0.0]), **values)

        return placed


class FakePage:
    """Page, as far as a feature needs one."""

    root = "/scene"

    def __init__(self, address: tuple[str, int]) -> None:
        self.link = ServerConnection(address)
        self.first_panel: dict[str, Any] = {}
        self.tabs: list[str] = []
        self.server = SimpleNamespace(
            gui=FakeGui(),
            scene=FakeScene(),
            get_clients=dict,
            on_client_connect=lambda callback: None,
            on_client_disconnect=lambda callback: None,
        )

    def tab(self, name: str) -> Any:
        """Tab of this name."""
        self.tabs.append(name)
        return nullcontext()
