"""Configs that must be refused, each with what its one sentence must say."""

from typing import NamedTuple

MINIMAL = 'name = "bad"\n[oracle]\nname = "cantilever"\n'
"""The shortest config; a bad table is appended to it."""


class Bad(NamedTuple):
    """A bad config: its text (or bytes), ``--set`` overrides, and a pattern of the sentence."""

    what: str
    text: str | bytes
    match: str
    overrides: tuple[str, ...] = ()


def appended(what: str, tables: str, match: str) -> Bad:
    return Bad(what, MINIMAL + tables + "\n", match)


def prepended(what: str, keys: str, match: str) -> Bad:
    return Bad(what, keys + "\n" + MINIMAL, match)


def overridden(what: str, override: str, match: str) -> Bad:
    return Bad(what, MINIMAL, match, (override,))


HUGE = "1" + "0" * 400
"""A TOML whole number that no float64 can hold."""

BAD = [
    # Unknown keys, with the nearest known one.
    prepended("unknown key", "sed = 1", r"unknown key 'sed'; did you mean 'seed'\?"),
    prepended("unknown key like no other", "colour = 1", r"unknown key 'colour'; known are version, name, title, seed"),
    appended("unknown table", "[ft]", r"unknown key 'ft'; did you mean 'fit'\?"),
    appended("unknown key of a table", "[fit]\ndegre = 2", r"unknown key 'fit\.degre'; did you mean 'degree'\?"),
    appended("unknown key of the oracle", 'nmae = "x"', r"unknown key 'oracle\.nmae'; did you mean 'name'\?"),
    appended("unknown key of screening", "[screening]\nalfa = 0.1", r"'screening\.alfa'; did you mean 'alpha'\?"),
    appended("unknown key of require", "[require]\nmax_relative_eror = 1.0", r"did you mean 'max_relative_error'\?"),
    appended(
        "unknown key of a factor",
        "[factors.load]\nlow = 1.0\nhihg = 2.0",
        r"unknown key 'factors\.load\.hihg'; did you mean 'high'\?",
    ),
    overridden("unknown key by --set", "fit.degre=2", r"unknown key 'fit\.degre'; did you mean 'degree'\?"),
    # Missing parts.
    Bad("no oracle table", 'name = "bad"\n', r"the table 'oracle' is missing"),
    Bad("no oracle name", 'name = "bad"\n[oracle]\n', r"the key 'oracle\.name' is missing"),
    Bad("no name", '[oracle]\nname = "cantilever"\n', r"the key 'name' is missing"),
    Bad("empty file", "", r"the key 'name' is missing"),
    appended("a range with one end", "[factors.load]\nlow = 1.0", r"the key 'factors\.load\.high' is missing"),
    # Wrong types.
    prepended("text for a number", 'seed = "7"', r"seed should be a whole number, got '7'"),
    prepended("true for the seed", "seed = true", r"seed should be a whole number, got True"),
    prepended("fraction for the seed", "seed = 1.5", r"seed should be a whole number, got 1\.5"),
    prepended("true for the version", "version = true", r"version should be 1, got True"),
    prepended("another version", "version = 2", r"version should be 1, got 2"),
    prepended("number for a text", "title = 3", r"title should be a string, got 3"),
    Bad("number for the name", 'name = 3\n[oracle]\nname = "cantilever"\n', r"name should be a string, got 3"),
    Bad("spaces in the name", 'name = "a b"\n[oracle]\nname = "cantilever"\n', r"letters, digits and underscores"),
    Bad("newline in the name", 'name = "a\\n"\n[oracle]\nname = "cantilever"\n', r"letters, digits and underscores"),
    Bad("number for a table", 'name = "bad"\noracle = 3\n', r"oracle should be a .*, got 3"),
    appended("list for a table", "[[factors]]\nlow = 1.0", r"factors should be a .*, got \["),
    appended("text for a design", '[fit]\ndesign = "uniform"', r"fit\.design should be a .*, got 'uniform'"),
    appended("true for a range", "[factors.load]\nlow = true\nhigh = 2.0", r"load\.low should be a number, got True"),
    appended("text for a range", '[factors.load]\nlow = "1"\nhigh = 2.0', r"load\.low should be a number, got '1'"),
    appended("true for alpha", "[screening]\nalpha = true", r"screening\.alpha should be a number, got True"),
    appended(
        "heredity of a backward selection",
        '[fit]\nheredity = "weak"',
        r"fit: heredity 'weak' needs selection 'forward'",
    ),
    appended("no such selection", '[fit]\nselection = "sideways"', r"fit\.selection"),
    appended("gradients of a backward selection", "[fit]\ngradients = true", r"needs fit\.selection = 'forward'"),
    appended(
        "too few runs to select from",
        '[fit]\nselection = "forward"\n[fit.design]\nmethod = "random"\nn_runs = 8',
        r"8 runs are too few for a fit in 4 factors; use n_runs = 9 or more",
    ),
    appended("number for a switch", "[fit]\ntrim = 1", r"fit\.trim should be a boolean, got 1"),
    appended("text for a list", '[export]\ntargets = "c99"', r"export\.targets should be a list, got 'c99'"),
    appended("date for a number", "[fit]\ndegree = 2020-01-01", r"fit\.degree should be a whole number or 'auto', got"),
    appended("true for a parameter", "[oracle.parameters]\nyoung = true", r"young must be a number, got True"),
    appended("text for a parameter", '[oracle.parameters]\nyoung = "x"', r"young must be a number, got 'x'"),
    appended(
        "list for a parameter", "[oracle.parameters]\nyoung = [1]", r"young should be a finite number, .*got \[1\]"
    ),
    appended("true for n_runs", '[fit.design]\nmethod = "uniform"\nn_runs = true', r"n_runs must be a whole number"),
    appended(
        "fraction for n_runs", '[fit.design]\nmethod = "uniform"\nn_runs = 30.0', r"n_runs must be a whole number"
    ),
    # Values out of bounds.
    prepended("negative seed", "seed = -1", r"seed should be greater than or equal to 0, got -1"),
    prepended("huge seed", f"seed = {2**63}", rf"seed should be less than or equal to {2**63 - 1}, got {2**63}"),
    appended("degree 0", "[fit]\ndegree = 0", r"fit\.degree should be greater than or equal to 1 or 'auto', got 0"),
    appended("degree 13", "[fit]\ndegree = 13", r"fit\.degree should be less than or equal to 12 or 'auto', got 13"),
    appended(
        "evidence in another basis",
        '[fit]\nselection = "evidence"\nbasis = "chebyshev"',
        r"fit: selection 'evidence' needs basis 'legendre', got 'chebyshev'",
    ),
    appended("alpha 1", "[screening]\nalpha = 1.0", r"screening\.alpha should be less than 1, got 1\.0"),
    appended(
        "one validation run", "[validation]\nn_runs = 1", r"validation\.n_runs should be greater than or equal to 2"
    ),
    appended(
        "failed fraction 2", "max_failed_fraction = 2.0", r"max_failed_fraction should be less than or equal to 1"
    ),
    appended("error 0", "[require]\nmax_relative_error = 0.0", r"max_relative_error should be greater than 0"),
    # Numbers that are not finite, or too large.
    appended(
        "nan in a range", "[factors.load]\nlow = nan\nhigh = 2.0", r"load\.low should be a finite number, got nan"
    ),
    appended(
        "inf in a range", "[factors.load]\nlow = 1.0\nhigh = inf", r"load\.high should be a finite number, got inf"
    ),
    appended("nan parameter", "[oracle.parameters]\nyoung = nan", r"young should be a finite number.*got nan"),
    appended("inf parameter", "[oracle.parameters]\nyoung = -inf", r"young should be a finite number.*got -inf"),
    appended("nan alpha", "[screening]\nalpha = nan", r"screening\.alpha should be .*, got nan"),
    appended("nan requirement", "[require]\nmax_relative_error = nan", r"max_relative_error should be .*, got nan"),
    appended("inf requirement", "[require]\nmax_relative_error = inf", r"max_relative_error should be .*, got inf"),
    appended("inf runs per term", "[fit]\nruns_per_term = inf", r"fit\.runs_per_term should be .*, got inf"),
    appended("huge range", f"[factors.load]\nlow = 1\nhigh = {HUGE}", r"factors\.load\.high should be a"),
    appended("huge parameter", f"[oracle.parameters]\nyoung = {HUGE}", r"young"),
    appended("huge levels", f'[fit.design]\nmethod = "uniform"\nlevels = {HUGE}', r"levels"),
    appended("too wide", "[factors.load]\nlow = -1.7e308\nhigh = 1.7e308", r"factor 'load': the range .* is too wide"),
    prepended("more digits than Python reads", "seed = " + "1" * 5000, r"not valid TOML|seed should be"),
    overridden("more digits by --set", "seed=" + "1" * 5000, r"--set|seed should be"),
    # Factors.
    appended(
        "low above high", "[factors.load]\nlow = 2.0\nhigh = 1.0", r"'load': low must be below high, got low = 2\.0"
    ),
    appended("low equal to high", "[factors.load]\nlow = 2.0\nhigh = 2.0", r"factor 'load': low must be below high"),
    appended(
        "unknown factor",
        "[factors.lod]\nlow = 1.0\nhigh = 2.0",
        r"factors: unknown factor 'lod'; did you mean 'load'\?",
    ),
    appended(
        "factor in another unit",
        '[factors.length]\nlow = 47.5\nhigh = 52.5\nunit = "mm"',
        r"factors: factor 'length' is in 'm', not 'mm'",
    ),
    appended("newline in a key", '[factors."a\\nb"]\nlow = "x"\nhigh = 2.0', r"factors\."),
    appended(
        "unknown kept factor", '[screening]\nkeep = ["lod"]', r"keep: unknown factor 'lod'; did you mean 'load'\?"
    ),
    # Oracles.
    Bad("unknown oracle", 'name = "bad"\n[oracle]\nname = "cantilver"\n', r"'cantilver'; did you mean 'cantilever'\?"),
    Bad(
        "a file without .py",
        'name = "bad"\noracle = "spring.tip"\n',
        r"an oracle in a file goes by path/to/file\.py:name",
    ),
    appended(
        "one [compare]", '[compare]\nname = "b"\nmodel = "b.json"', r"a list of tables, each headed \[\[compare\]\]"
    ),
    Bad("unknown oracle as a text", 'name = "bad"\noracle = "cantilver"\n', r"did you mean 'cantilever'\?"),
    *(
        Bad(f"oracle file {name}", f"name = 'bad'\noracle = '{name}'\n", match)
        for name, match in (
            ("/etc/oracle.py:spring", r"oracle\.name: the path '/etc/oracle\.py' is not allowed: use a relative path"),
            ("../spring.py:spring", r"the path '\.\./spring\.py' is not allowed"),
            ("in/../spring.py:spring", r"is not allowed"),
            (".hidden/spring.py:spring", r"is not allowed"),
            ("C:\\spring.py:spring", r"is not allowed"),
            ("spring.py", r"'spring\.py' is not of the form path/to/file\.py:name"),
            ("spring.py:", r"is not of the form"),
            ("spring.py:os.system", r"is not of the form"),
            ("os:system", r"is not of the form path/to/file\.py:name; one of an installed package goes by its name"),
            ("my.package:spring", r"is not of the form"),
            ("spring.py:spring", r"there is no file spring\.py in /.*relative to the config's folder|is from no file"),
        )
    ),
    appended("unknown parameter", "[oracle.parameters]\nyuong = 1.0", r"no setting 'yuong'; did you mean 'young'\?"),
    appended("impossible parameter", "[oracle.parameters]\nyoung = -1.0", r"young must be positive, got -1\.0"),
    # Designs.
    appended("unknown design", '[fit.design]\nmethod = "unifrom"', r"design 'unifrom'; did you mean 'uniform'\?"),
    appended(
        "unknown screening design", '[screening.design]\nmethod = "plackett"', r"screening\.design: unknown design"
    ),
    appended(
        "unknown design setting",
        '[fit.design]\nmethod = "uniform"\nlevel = 6',
        r"fit\.design: design 'uniform' has no setting 'level'; did you mean 'levels'\?",
    ),
    appended(
        "fewer runs than terms",
        '[fit.design]\nmethod = "uniform"\nn_runs = 12',
        r"fit\.design: 12 runs are fewer than the 15 terms .* use n_runs = 15 or more",
    ),
    appended(
        "unbalanced uniform design",
        '[fit.design]\nmethod = "uniform"\nn_runs = 31\nlevels = 6',
        r"31 runs and 6 levels do not fit; use n_runs = 30 or 36",
    ),
    appended("one level", '[fit.design]\nmethod = "uniform"\nlevels = 1', r"levels of a uniform design must be"),
    appended(
        "impossible Plackett-Burman size",
        '[screening.design]\nmethod = "plackett_burman"\nn_runs = 13',
        r"no Plackett-Burman design with 13 runs can be built; nearest sizes: 8, 12, 16",
    ),
    appended(
        "too few columns",
        '[screening.design]\nmethod = "plackett_burman"\nn_runs = 4',
        r"4 runs has 3 columns, too few for 4 factors; use n_runs = 12",
    ),
    appended(
        "screening on many levels",
        '[screening.design]\nmethod = "uniform"\nbudget = 0',
        r"'uniform' is not a two-level design",
    ),
    appended(
        "screening on columns that are not orthogonal",
        '[screening.design]\nmethod = "uniform"\nlevels = 2\nn_runs = 10\nbudget = 0',
        r"screening\.design: .*orthogonal",
    ),
    appended(
        "more screening runs than memory",
        '[screening.design]\nmethod = "random"\nn_runs = 1000000000000',
        r"screening\.design",
    ),
    appended(
        "filling with two levels",
        '[fit.design]\nmethod = "plackett_burman"',
        r"fit\.design: 2 levels cannot show a degree of 2; use 3 levels or more",
    ),
    appended(
        "a full factorial of unreadable levels",
        '[fit.design]\nmethod = "full_factorial"\nlevels = "3, x"',
        r"fit\.design: levels of a full factorial must be whole numbers of at least 1, got '3, x'",
    ),
    # Exports.
    appended(
        "unknown export", '[export]\ntargets = ["c9"]', r"export\.targets: unknown export 'c9'; did you mean 'c99'\?"
    ),
    Bad("C keyword as name", 'name = "double"\n[oracle]\nname = "cantilever"\n', r"prefix 'double' is not allowed"),
    appended("C keyword as prefix", '[export]\nprefix = "while"', r"export\.prefix: prefix 'while' is not allowed"),
    appended("spaces in the prefix", '[export]\nprefix = "a b"', r"export\.prefix: prefix name 'a b' is not allowed"),
    # Not TOML, not text.
    Bad("no value", 'name = "bad"\nseed =\n', r"is not valid TOML: .*line 2"),
    Bad("key twice", 'name = "bad"\nname = "worse"\n', r"is not valid TOML: .*line 2"),
    Bad("broken table", MINIMAL + "[fit\n", r"is not valid TOML: .*line 4"),
    Bad("not UTF-8", b'name = "\xff"\n', r"cannot read the config .*: it is not UTF-8 text"),
    Bad("brackets without end", "x = " + "[" * 5000, r"is not valid TOML"),
    # --set.
    overridden("--set without value", "fit.degree", r"--set 'fit\.degree' is not of the form dotted\.key=value"),
    overridden("--set without key", "=3", r"--set '=3' is not of the form dotted\.key=value"),
    overridden("--set with an empty part", "fit..degree=3", r"--set 'fit\.\.degree=3' is not of the form"),
    overridden("--set below a value", "name.first=3", r"--set 'name\.first=3': 'name' is a value, not a table"),
    overridden("--set of a wrong type", "fit.degree=two", r"fit\.degree should be a whole number or 'auto', got 'two'"),
    overridden("--set of nothing", "seed=", r"seed should be a whole number, got ''"),
    overridden("--set not text", "title=\udcff", r"title|--set"),
]
