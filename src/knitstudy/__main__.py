"""Makes ``python -m knitstudy`` the `knitstudy` command."""

from knitstudy.run.commands.main import main

if __name__ == "__main__":
    main()
