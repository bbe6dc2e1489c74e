"""The config: what it means, that it survives a round trip, and that whatever is wrong gets one clear sentence."""

import random
import re
import tomllib
from pathlib import Path

import pytest
import tomli_w

from pipeline import Config, InputError, load_config, resolve
from pipeline.config import differences, dump_config, json_schema, parse_config
from tests.pipeline.bad_inputs import BAD, MINIMAL, Bad

CONFIGS = Path(__file__).parents[2] / "configs"
EXAMPLES = sorted(CONFIGS.glob("*.toml"))


def written(folder: Path, text: str | bytes) -> Path:
    path = folder / "config.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


class TestGoodConfig:
    def test_defaults(self):
        config = parse_config(MINIMAL)
        assert config.version == 1
        assert config.seed == 0
        assert config.title == ""
        assert config.oracle.parameters == {}
        assert config.oracle.max_failed_fraction == 0.0
        assert config.factors == {}
        assert config.screening.design.method == "plackett_burman"
        assert config.screening.design.settings == {}
        assert config.screening.alpha == 0.05
        assert config.screening.keep == []
        assert config.fit.design.method == "uniform"
        assert (config.fit.degree, config.fit.interactions, config.fit.trim) == (2, True, True)
        assert config.validation.n_runs == 1000
        assert config.require.max_relative_error is None
        assert not config.require.certified_inverse
        assert config.export.targets == ["c99"]
        assert config.export.prefix is None

    @pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
    def test_examples_survive_a_round_trip(self, path):
        config = load_config(path)
        again = parse_config(dump_config(config))
        assert again == config
        assert dump_config(again) == dump_config(config)

    @pytest.mark.parametrize(
        "title",
        ["", "µm per N", 'quo"ted', "back\\slash", "two\nlines", "<script>", "tab\there", "del\x7f", "'''", '"""'],
    )
    def test_any_title_survives_a_round_trip(self, title):
        config = parse_config(tomli_w.dumps({"title": title}) + MINIMAL)
        assert config.title == title
        assert parse_config(dump_config(config)) == config

    @pytest.mark.parametrize("value", [5e-324, 0.1, 1 / 3, 1.7976931348623157e308, 71.7e9])
    def test_numbers_survive_a_round_trip(self, value):
        config = parse_config(MINIMAL + f"[oracle.parameters]\nyoung = {value!r}\n")
        again = parse_config(dump_config(config))
        assert again.oracle.parameters["young"] == value

    def test_whole_numbers_do_for_numbers(self):
        config = parse_config(MINIMAL + "[factors.load]\nlow = 1\nhigh = 2\n[oracle.parameters]\nyoung = 70000000000\n")
        study = resolve(config)
        assert study.space.factors[study.space.index("load")].low == 1.0
        assert study.oracle.parameters["young"] == 70e9

    def test_settings_of_a_design_are_kept(self):
        config = parse_config(MINIMAL + '[fit.design]\nmethod = "uniform"\nn_runs = 42\nbudget = 7\n')
        assert config.fit.design.settings == {"n_runs": 42, "budget": 7}

    def test_a_design_keeps_its_method_when_only_a_setting_is_given(self):
        config = parse_config(MINIMAL + "[screening.design]\nn_runs = 20\n[fit.design]\nlevels = 5\n")
        assert (config.screening.design.method, config.fit.design.method) == ("plackett_burman", "uniform")

    def test_a_config_cannot_be_changed(self):
        config = parse_config(MINIMAL)
        with pytest.raises(ValueError, match="frozen"):
            config.seed = 3  # type: ignore[misc]

    def test_a_range_replaces_the_oracles(self):
        study = resolve(parse_config(MINIMAL + '[factors.load]\nlow = 0.1\nhigh = 0.2\nunit = "N"\n'))
        by_name = {f.name: f for f in study.space}
        assert (by_name["load"].low, by_name["load"].high) == (0.1, 0.2)
        assert (by_name["width"].low, by_name["width"].high) == (9.5e-3, 10.5e-3)

    def test_differences_are_dotted_keys(self):
        ours = parse_config(MINIMAL)
        theirs = parse_config(MINIMAL + "[fit]\ndegree = 3\n[factors.load]\nlow = 1.0\nhigh = 2.0\n")
        assert differences(ours, ours) == []
        assert differences(ours, theirs) == ["factors.load", "fit.degree"]

    def test_a_byte_order_mark_is_no_error(self, tmp_path):
        assert load_config(written(tmp_path, b"\xef\xbb\xbf" + MINIMAL.encode())).name == "bad"

    def test_the_schema_knows_every_key(self):
        assert set(json_schema()["properties"]) == set(Config.model_fields)


class TestOverrides:
    @pytest.mark.parametrize(
        ("override", "value"),
        [
            ("fit.degree=3", lambda c: c.fit.degree == 3),
            ("fit.degree = 3", lambda c: c.fit.degree == 3),
            ("title=two words", lambda c: c.title == "two words"),
            ('title="3"', lambda c: c.title == "3"),
            ("title=a=b", lambda c: c.title == "a=b"),
            ('screening.keep=["load"]', lambda c: c.screening.keep == ["load"]),
            ("factors.load={low = 1.0, high = 2.0}", lambda c: c.factors["load"].high == 2.0),
            ("require.max_relative_error=1e-9", lambda c: c.require.max_relative_error == 1e-9),
            ("fit.trim=false", lambda c: c.fit.trim is False),
            ("fit.design.method=random", lambda c: c.fit.design.method == "random"),
        ],
    )
    def test_replaces_a_setting(self, override, value):
        assert value(parse_config(MINIMAL, overrides=[override]))

    def test_the_last_one_counts(self):
        assert parse_config(MINIMAL, overrides=["seed=1", "seed=2"]).seed == 2


class TestBadConfig:
    @pytest.mark.parametrize("bad", BAD, ids=lambda b: b.what)
    def test_is_refused_with_one_sentence(self, bad: Bad, tmp_path):
        with pytest.raises(InputError) as caught:
            resolve(load_config(written(tmp_path, bad.text), bad.overrides))
        sentence = str(caught.value)
        assert re.search(bad.match, sentence), sentence
        assert sentence.splitlines() == [sentence]
        assert sentence == sentence.strip()

    def test_a_problem_of_the_file_names_the_file(self, tmp_path):
        path = written(tmp_path, "seed = ")
        with pytest.raises(InputError, match=re.escape(str(path))):
            load_config(path)

    def test_missing_file(self, tmp_path):
        with pytest.raises(InputError, match=r"cannot read the config .*nowhere\.toml: No such file"):
            load_config(tmp_path / "nowhere.toml")

    def test_directory(self, tmp_path):
        with pytest.raises(InputError, match=r"cannot read the config .*: Is a directory"):
            load_config(tmp_path)

    def test_a_range_too_narrow_for_float64(self, tmp_path):
        text = MINIMAL + "[factors.load]\nlow = 0.0\nhigh = 5e-324\n"
        with pytest.raises(InputError, match="factor 'load'"):
            resolve(parse_config(text))


JUNK = [
    -1, 0, 1, 7, 31, 2**63, -(2**63), 0.5, 1e308, -1e308, 1e-320, float("nan"), float("inf"), True, False,
    "", "x", "uniform", "random", "double", "µ", "a\nb", [], [1], ["load"], {}, {"low": 1.0}, {"a": {"b": 1}},
]  # fmt: skip


def mutated_document(document: dict, rng: random.Random) -> dict:
    """`document` with one place changed: a value replaced, a key dropped, misspelt or added."""
    table = document
    while True:
        deeper = [v for v in table.values() if isinstance(v, dict)]
        if not deeper or rng.random() < 0.4:
            break
        table = rng.choice(deeper)
    key = rng.choice(list(table)) if table else "new"
    action = rng.randrange(4)
    if action == 0 or key not in table:
        table[key] = rng.choice(JUNK)
    elif action == 1:
        del table[key]
    elif action == 2:
        table[key + rng.choice("xs_")] = table.pop(key)
    else:
        table[rng.choice(["seed", "n_runs", "levels", "young", "load", "low", "method"])] = rng.choice(JUNK)
    return document


def mutated_text(text: str, rng: random.Random) -> str:
    """`text` with a few characters replaced, dropped or inserted."""
    letters = list(text)
    for _ in range(rng.randint(1, 4)):
        place = rng.randrange(len(letters))
        letters[place : place + rng.randrange(3)] = rng.choice(['"', "[", "]", "=", "\n", "9", ".", "é", "\x00", "#"])
    return "".join(letters)


class TestFuzz:
    @pytest.mark.parametrize("seed", range(10))
    def test_nothing_but_an_input_error_comes_of_a_mutated_config(self, seed):
        rng, refused = random.Random(seed), 0
        for _ in range(20):
            # The HexFlex factorises a frame each time it is resolved: less of it.
            path = CONFIGS / ("hexflex.toml" if rng.random() < 0.15 else "smoke.toml")
            text = path.read_text(encoding="utf-8")
            if rng.random() < 0.7:
                document = tomllib.loads(text)
                for _ in range(rng.randint(1, 2)):
                    document = mutated_document(document, rng)
                text = tomli_w.dumps(document)
            else:
                text = mutated_text(text, rng)
            try:
                resolve(parse_config(text))
            except InputError as error:
                refused += 1
                sentence = str(error)
            except Exception as error:
                pytest.fail(f"{type(error).__name__}: {error}\n{text}")
            else:
                sentence = ""
            assert "\n" not in sentence, text
        assert refused >= 5, "the mutations hardly break anything: they test nothing"
