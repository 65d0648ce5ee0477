"""Words from files and arguments, for terminals and charts: nothing in them acts on what shows them."""


def printable(words: object) -> str:
    r"""Return words on one line, with every character that is not printed written as TOML and JSON write it.

    Examples
    --------
    >>> print(printable("red \x1b[31m film\n"))
    red \u001b[31m film\u000a
    """
    return "".join(character if character.isprintable() else _escaped(character) for character in str(words))


def chart_text(words: object) -> str:
    r"""Return words as Matplotlib shows them unchanged: no dollar begins a formula.

    Examples
    --------
    >>> print(chart_text("VHB, 5 $ a roll"))
    VHB, 5 \$ a roll
    """
    return printable(words).replace("$", r"\$")


def _escaped(character: str) -> str:
    number = ord(character)
    return f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"
