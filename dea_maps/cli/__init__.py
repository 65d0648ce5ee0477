"""The command line of ``dea-maps``: from words and specifications to calls of the library."""
