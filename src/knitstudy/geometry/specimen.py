"""What is simulated, a knit or a pair of crossing yarns, from the file of its geometry."""

from knitstudy.errors import DataFileError
from knitstudy.geometry.pair import YarnPair
from knitstudy.geometry.pattern import Knit

SPECIMENS = {"knit": Knit, "pair": YarnPair}


def read_specimen(dataset):
    """The knit or pair that a geometry dataset describes.

    Parameters
    ----------
    dataset : xarray.Dataset
        Of `Knit.to_dataset` or `YarnPair.to_dataset`; its attribute ``specimen`` says which.

    Returns
    -------
    Knit or YarnPair

    Raises
    ------
    DataFileError
        When it is neither, or a variable is missing.
    """
    name = dataset.attrs.get("specimen")
    if name not in SPECIMENS:
        raise DataFileError(
            f"geometry dataset: its attribute specimen is {name!r}; allowed are {', '.join(SPECIMENS)}"
        )
    return SPECIMENS[name].from_dataset(dataset)
