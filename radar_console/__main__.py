"""`python -m radar_console` is `radar-console`."""

from radar_console.app import main

if __name__ == "__main__":
    main()
