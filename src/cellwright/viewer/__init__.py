"""Those who look on: guests of a server, in processes of their own."""
