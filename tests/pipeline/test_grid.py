"""The grid of a sweep: what may be swept, which members there are, and what their folders are called."""

import re
import tomllib

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments import Factor, FactorSpace
from pipeline import InputError, resolve
from pipeline.config import differences, parse_config
from pipeline.grid import LONGEST_NAME, MOST_MEMBERS, Member, axes, members, parse_over, toml
from tests.pipeline.bad_inputs import MINIMAL

SAFE = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.+=,-]*")
SPACE = FactorSpace((Factor("load", "N", 0.8, 1.2), Factor("length", "m", -1.0, 3.0)))


def names(**table) -> list[str]:
    return [m.name for m in members(axes({k.replace("__", "."): v for k, v in table.items()}))]


class TestOver:
    @pytest.mark.parametrize(
        ("text", "values"),
        [
            ("fit.degree=1,2,3", [1, 2, 3]),
            ("x.y=1e-3, 2e-3", [1e-3, 2e-3]),
            ("x.y=backward,forward", ["backward", "forward"]),
            ("x.y=true,false,1", [True, False, 1]),
            ('x.y="a,b",c', ["a,b", "c"]),
            ("x.y='[',b", ["[", "b"]),
            ('x.y="a\\",b",c', ['a",b', "c"]),
            ("x.y=[1, 2],[3],[]", [[1, 2], [3], []]),
            ("x.y={low = 1, high = 2},{low = 3, high = 4}", [{"low": 1, "high": 2}, {"low": 3, "high": 4}]),
            ("x.y=a=b", ["a=b"]),
        ],
    )
    def test_reads_values_as_toml_or_words(self, text, values):
        ((_, found),) = parse_over([text]).items()
        assert found == values
        assert [type(v) for v in found] == [type(v) for v in values]

    @pytest.mark.parametrize(
        ("texts", "match"),
        [
            (["fit.degree"], r"'fit\.degree' is not of the form dotted\.key=a,b,c"),
            (["=1,2"], r"is not of the form"),
            (["fit.degree="], r"fit\.degree: a value is empty"),
            (["fit.degree=1,,2"], r"a value is empty"),
            (["fit.degree=1,2,"], r"a value is empty"),
            (["fit.degree=[1,2"], r"a bracket or a quote is open"),
            (["fit.degree='a,b"], r"a bracket or a quote is open"),
            (["a=1\n2"], r"cannot be printed"),
            (["a.b=1", "a.b=2"], r"--over names a\.b twice"),
        ],
    )
    def test_refuses_what_is_none(self, texts, match):
        with pytest.raises(InputError, match=match):
            parse_over(texts)


class TestAxes:
    @pytest.mark.parametrize(
        ("table", "match"),
        [
            ({}, r"nothing to sweep: .*--over dotted\.key=a,b,c"),
            ({"fit.degree": []}, r"fit\.degree: give a list of values, got \[\]"),
            ({"fit.degree": "12"}, r"give a list of values, got '12'"),
            ({"fit.degree": [1, 2, 1]}, r"fit\.degree: the value 1 occurs twice"),
            ({"x.y": [1, 1.0]}, r"the value 1 occurs twice"),
            ({"x.y": [{"a": 1, "b": 2}, {"b": 2.0, "a": 1}]}, r"occurs twice"),
            ({"x.y": [float("nan")]}, r"nan is not finite"),
            ({"x.y": [[1, float("inf")]]}, r"inf is not finite"),
            ({"x.y": [2**64]}, r"at most 64 bits"),
            ({"x.y": [tomllib.loads("d = 2026-11-22")["d"]]}, r"a value is a number, a text, true, false"),
            ({"x.y": ["a\nb"]}, r"cannot be printed"),
            ({"fit..degree": [1]}, r"'fit\.\.degree': a key is words with dots"),
            ({"../x": [1]}, r"a key is words with dots"),
            ({"a.../..": [1]}, r"a key is words with dots"),
            ({"-x": [1]}, r"a key is words with dots"),
            ({"factors.*.high": [1]}, r"only ranges know '\*'; ranges=0\.5,1,2 scales"),
            ({"sweep.x": [1]}, r"'sweep\.x': this cannot be swept"),
            ({"version": [1]}, r"this cannot be swept"),
            ({"fit.design": [{"method": "sobol"}], "fit.design.n_runs": [9]}, r"fit\.design and fit\.design\.n_runs"),
            ({"a.b, c.d": [[1, 2]], "c.d": [3]}, r"names c\.d twice"),
            ({"a.b, c.d": [[1, 2], [3]]}, r"each value is a list of 2, one for each key, got \[3\]"),
            ({"a.b, c.d": [1, 2]}, r"each value is a list of 2"),
            ({"ranges": [0]}, r"scaled by a positive number, got 0"),
            ({"ranges": [-1.0]}, r"scaled by a positive number"),
            ({"ranges": [True]}, r"scaled by a positive number, got true"),
            ({"ranges.a b": [1]}, r"the name of a factor"),
            ({"a.b": list(range(40)), "c.d": list(range(40))}, rf"1600 members; the most is {MOST_MEMBERS}"),
        ],
    )
    def test_refuses_what_cannot_be_swept(self, table, match):
        with pytest.raises(InputError, match=match):
            axes(table)

    def test_true_is_not_one(self):
        assert names(x__y=[True, 1]) == ["y=true", "y=1"]

    def test_the_grid_is_full_and_its_last_axis_the_fastest(self):
        found = members(axes({"a.b": [1, 2], "c.d, e.f": [[3, "x"], [4, "y"]]}))
        assert [dict(m.settings) for m in found] == [
            {"a.b": b, "c.d": d, "e.f": f} for b in (1, 2) for d, f in ((3, "x"), (4, "y"))
        ]


class TestNames:
    def test_are_readable(self):
        assert names(oracle__parameters__thickness=[1e-3, 0.002, 71.7e9]) == [
            "thickness=0.001", "thickness=0.002", "thickness=71700000000",
        ]  # fmt: skip
        assert names(fit__selection=["backward", "forward"]) == ["selection=backward", "selection=forward"]
        assert names(factors__load__low=[-1]) == ["load.low=-1"]

    def test_of_equal_last_parts_show_what_differs(self):
        assert names(fit__design__n_runs=[30], screening__design__n_runs=[12]) == [
            "fit.design.n_runs=30,screening.design.n_runs=12"
        ]
        assert names(a__x=[1], x=[2]) == ["a.x=1,x=2"]

    def test_do_not_depend_on_the_order_of_the_keys_or_on_other_values(self):
        one, other = names(a__b=[1], c__d=[2]), names(c__d=[2], a__b=[1, 3])
        assert one[0] == other[0] == "b=1,d=2"

    @pytest.mark.parametrize("hostile", ["../../etc", "/etc/passwd", "..", ".", "", "a/b", "a\\b", "C:", "~", "x y"])
    def test_of_hostile_values_stay_in_the_folder(self, hostile, tmp_path):
        (name,) = names(oracle__name=[hostile])
        assert SAFE.fullmatch(name)
        assert (tmp_path / name).resolve().parent == tmp_path.resolve()
        assert names(oracle__name=[hostile, "plain"])[0] == name

    def test_that_would_be_one_on_some_disks_differ(self):
        assert len({n.casefold() for n in names(title=["a", "A"])}) == 2
        assert len(set(names(title=["a/b", "a:b", "a-b"]))) == 3

    def test_that_would_be_too_long_are_cut(self):
        found = names(title=["x" * 5000, "x" * 4999 + "y"])
        assert max(map(len, found)) <= LONGEST_NAME
        assert len(set(found)) == 2

    @given(st.lists(st.text(max_size=60).filter(str.isprintable), min_size=1, max_size=5, unique=True))
    @settings(max_examples=60, deadline=None)
    def test_are_safe_and_unique_whatever_the_texts(self, texts):
        found = names(title=texts, seed=[1, 2])
        assert len({n.casefold() for n in found}) == 2 * len(texts)
        assert all(SAFE.fullmatch(n) and len(n) <= LONGEST_NAME for n in found)


class TestOverrides:
    @given(
        st.recursive(
            st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False, allow_infinity=False)
            | st.text(max_size=9).filter(str.isprintable),
            lambda inner: st.lists(inner, max_size=3)
            | st.dictionaries(st.text(max_size=4).filter(str.isprintable), inner, max_size=3),
            max_leaves=6,
        )
    )  # fmt: skip
    @settings(max_examples=60, deadline=None)
    def test_toml_reads_back(self, value):
        found = tomllib.loads(f"value = {toml(value)}")["value"]
        assert found == value
        assert type(found) is type(value)

    def test_reach_the_config(self):
        (member,) = members(axes({"oracle.parameters.young": [2.1e11], "factors.load": [{"low": 1.0, "high": 2.0}]}))
        config = parse_config(MINIMAL, "here", member.overrides)
        assert config.oracle.parameters == {"young": 2.1e11}
        assert config.factors["load"].high == 2.0

    def test_ranges_are_scaled_about_their_centre(self):
        member = Member("m", (("ranges", 2), ("ranges.le*", 0.5)))
        assert member.overrides == []
        low, high = (float(text.partition("=")[2]) for text in member.ranged(SPACE))
        assert member.ranged(SPACE)[0].startswith("factors.load.low=")
        assert (low, high) == pytest.approx((0.6, 1.4))

    def test_a_range_that_stays_keeps_its_bits(self):
        assert Member("m", (("ranges", 1),)).ranged(SPACE) == []

    def test_a_pattern_without_a_factor_is_refused(self):
        with pytest.raises(InputError, match=r"ranges\.T\*: no factor is called so; they are load, length"):
            Member("m", (("ranges.T*", 2),)).ranged(SPACE)


class TestTable:
    def test_dotted_keys_need_no_quotes(self):
        quoted = parse_config(MINIMAL + '[sweep]\n"fit.degree" = [1, 2]\n')
        plain = parse_config(MINIMAL + "[sweep]\nfit.degree = [1, 2]\n")
        assert quoted.sweep == plain.sweep == {"fit.degree": [1, 2]}

    @pytest.mark.parametrize(
        ("text", "match"),
        [
            ("[sweep]\nfit.degree = 3\n", r"sweep\.fit\.degree should be a list, got 3"),
            ("[sweep]\nfit.degree = []\n", r"sweep\.fit\.degree"),
            ("[[sweep]]\nx = 1\n", r"sweep should be a table, got"),
        ],
    )
    def test_that_is_none_is_refused(self, text, match):
        with pytest.raises(InputError, match=match):
            parse_config(MINIMAL + text)

    def test_is_no_part_of_a_study(self):
        config = parse_config(MINIMAL + "[sweep]\nfit.degree = [1, 2]\n")
        assert resolve(config).config.sweep is None
        assert differences(config, resolve(config).config) == []
