"""The pages for people: what the service holds and what it is doing. Rendered by the service; scripts are optional."""
