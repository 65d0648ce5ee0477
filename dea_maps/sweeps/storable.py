"""What a NetCDF file gives back as it was: checked by writing it, to a file in memory."""

import warnings

import xarray as xr

from ..checks import brief
from ..netcdf_lock import NETCDF_LOCK


def check_storable(name: str, variable: xr.Variable) -> None:
    """Check that a coordinate comes back from a file with the same values and attributes.

    NetCDF and its conventions act on some attributes, as ``scale_factor``, and others have values that no file holds.

    Parameters
    ----------
    name : str
        Of the coordinate.
    variable : Variable
        Its values and attributes.

    Raises
    ------
    ValueError
        If it does not, with the attribute that is to blame.

    Examples
    --------
    >>> check_storable("film", xr.Variable("film", [1.0, 2.0], {"note": "two films", "scale_factor": 0.1}))
    Traceback (most recent call last):
    ...
    ValueError: film has the attribute 'scale_factor' = 0.1, which a NetCDF file would not give back: leave it out
    """
    some = variable.isel({dim: slice(0, 2) for dim in variable.dims})
    if _comes_back(name, some):
        return
    if not _comes_back(name, xr.Variable(some.dims, some.data)):
        raise ValueError(
            f"{name} has a name, dimensions {variable.dims} or values of type {variable.dtype} that a NetCDF file "
            "would not give back: rename it or leave it out"
        )
    for key, value in variable.attrs.items():
        if not _comes_back(name, xr.Variable(some.dims, some.data, {key: value})):
            blame = f"the attribute {brief(key)} = {brief(value)}"
            raise ValueError(f"{name} has {blame}, which a NetCDF file would not give back: leave it out")
    raise ValueError(f"{name} has attributes that a NetCDF file would not give back together: leave some out")


def _comes_back(name: str, variable: xr.Variable) -> bool:
    """Write a coordinate, read it, and compare."""
    import netCDF4

    written = xr.Dataset(coords={name: variable})
    written[name].encoding = {"_FillValue": None}
    with NETCDF_LOCK, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        file = netCDF4.Dataset("in memory", "w", memory=0)
        try:
            written.dump_to_store(xr.backends.NetCDF4DataStore(file))
        except Exception:  # of the many kinds that xarray, netCDF4 and HDF5 raise
            file.close()
            return False
        content = bytes(file.close())
        with netCDF4.Dataset("in memory", memory=content) as file:
            try:
                found = xr.open_dataset(xr.backends.NetCDF4DataStore(file)).load()
            except Exception:  # what was written cannot be read
                return False
    return name in found.coords and found[name].variable.to_base_variable().identical(variable)
