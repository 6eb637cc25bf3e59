"""An environment that serves programs in other processes over a websocket."""
