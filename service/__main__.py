"""`python -m service`: serve the application at the configured address."""

from service.server import make_server
from service.settings import Settings


def main() -> None:
    """Serve until SIGTERM or SIGINT."""
    make_server(Settings()).run()


if __name__ == "__main__":
    main()
