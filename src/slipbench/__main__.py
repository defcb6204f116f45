"""Run the command: `python -m slipbench`."""

from slipbench.command import main

if __name__ == "__main__":
    main()
