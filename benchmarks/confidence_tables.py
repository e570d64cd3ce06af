"""The formula and the tables of docs/study.md: what the confidence of a finding is, and how often it was right.

    python -m benchmarks.confidence_tables

prints them. A test compares them with the page.
"""

from slipstick.study.confidence import Evidence, coefficients, confidence, counted, found

BANDS = (("0.9 or more", 0.95), ("0.8 to 0.9", 0.85), ("0.6 to 0.8", 0.7), ("0.4 to 0.6", 0.5), ("below 0.4", 0.2))
"""Bands of the confidence, and a value in each."""
KINDS = (("nothing else is found", Evidence(0.0, True, False, 1.0)),
         ("the same, a rare pair", Evidence(0.0, True, False, 1.0, True)),
         ("others are found, none of which may leave something in its blocks", Evidence(0.0, False, False, 1.0)),
         ("others are found, it has half of all nats", Evidence(0.0, False, False, 0.5)),
         ("the same, with a twentieth of all nats", Evidence(0.0, False, False, 0.05)),
         ("another one in its part of the bench gains more, it has a tenth of all nats",
          Evidence(0.0, False, True, 0.1)))
"""Kinds of findings, and their evidence but for the lead."""


def formula() -> str:
    """The logarithm of the odds."""
    constant, *others = coefficients("")
    variables = ("s q", "s [alone]", "[further]", "ln q", "[rare]")
    terms = (f"{'-' if c < 0 else '+'} {abs(c):.2f} {its}" for c, its in zip(others, variables, strict=True))
    return f"    logit P = {constant:.2f} {' '.join(terms)}"


def of_bands() -> str:
    """How many findings were right, each predicted from the other lists."""
    rows = (f"| {words} | {its.right} of {its.of} |" for words, its in ((words, counted(p)) for words, p in BANDS))
    return "\n".join(["| confidence, from the other lists | right findings |", "| --- | --- |", *rows])


def of_leads() -> str:
    """The confidence of some kinds of findings over their lead."""
    rows = (f"| {words} | {' | '.join(f'{confidence(one._replace(lead=lead)):.2f}' for lead in range(6))} |"
            for words, one in KINDS)
    return "\n".join(["| | lead 0 | 1 | 2 | 3 | 4 | 5 and more |", "| --- " * 7 + "|", *rows])


if __name__ == "__main__":
    print(formula(), of_bands(), of_leads(), sep="\n\n")
    for which, rows in found().items():
        expected, right = sum(confidence(one, which) for one, _ in rows), sum(its for _, its in rows)
        print(f"{which}: {expected:.0f} of {len(rows)} expected to be right by the other lists, and {right} are")
