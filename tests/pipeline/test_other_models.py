"""``[[compare]]``: another study's model in the config, the report and a CSV."""

import csv
import json
import shutil
import tomllib
from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pipeline
from experiments import oracles
from experiments.shells import Sheet
from pipeline import InputError, read_run, runner
from pipeline.config import dump_config, load_config, parse_config
from pipeline.report import figures
from pipeline.resolving import resolve
from pipeline.stages import provenance
from pipeline.store import RunFolder
from surrogates import dumps, load
from tests.pipeline import cases
from tests.pipeline.cases import SMALL, config_text, contents, reproducible
from tests.pipeline.test_report import page_of
from tests.surrogates.cases import hexflex_like

COMPARE = '[[compare]]\nname = "before"\nmodel = "old/model.json"\n'


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """Files of a study of the test oracle with another seed, which compares nothing."""
    oracles.register(cases.Counted)
    place = tmp_path_factory.mktemp("first")
    (place / "first.toml").write_text(config_text().replace("seed = 3", "seed = 4"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(runner, "write_report", lambda folder, outcome: folder.path / "report.html")
        pipeline.run(place / "first.toml", place / "run", SMALL)
    cases.forget()
    return contents(place / "run")


@pytest.fixture
def folder(first, counted, tmp_path, no_report):
    """A config and, beside it, the model that it has compared."""
    (tmp_path / "study.toml").write_text(config_text(more=COMPARE), encoding="utf-8")
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "model.json").write_bytes(first["model.json"])
    return tmp_path


def changed(folder, text: str) -> None:
    (folder / "old" / "model.json").write_text(text, encoding="utf-8")


def report(outcome, monkeypatch) -> None:
    """Write the report after all, without its figures, which take most of the time."""
    monkeypatch.undo()
    monkeypatch.setattr(figures, "uri", lambda draw, size: "data:,")
    runner.write_report(RunFolder(outcome.path), outcome)


def refused(folder, match: str) -> None:
    with pytest.raises(InputError, match=match):
        resolve(load_config(folder / "study.toml"))


class TestRun:
    def test_the_run_folder_is_complete_in_itself(self, folder):
        outcome = pipeline.run(folder / "study.toml", folder / "out", SMALL)
        shutil.rmtree(folder / "old")
        again = read_run(outcome.path)
        assert again.comparisons["before"].n_runs == 20
        before = reproducible(outcome.path)
        (outcome.path / "validation" / "compare_before.csv").unlink()
        pipeline.run(outcome.path / "config.toml", outcome.path)
        assert reproducible(outcome.path) == before

    def test_the_csv(self, folder):
        """The truth is of the second degree, so both models are it to rounding; the factor d does nothing."""
        outcome = pipeline.run(folder / "study.toml", folder / "out", SMALL)
        text = (outcome.path / "validation" / "compare_before.csv").read_text(encoding="utf-8")
        rows = list(csv.DictReader(text.splitlines()))
        assert [(r["response"], r["unit"], r["n_runs"]) for r in rows] == [("u", "m", "20"), ("v", "rad", "20")]
        found = outcome.comparisons["before"]
        for row, apart, theirs in zip(rows, found.apart, found.theirs, strict=True):
            assert float(row["apart_max_abs"]) == apart.largest < 1e-9
            assert float(row["theirs_rms_relative_to_range"]) == theirs.relative_rms
            assert [float(row[f"apart_most_{label}"]) for label in found.box.labels] == list(apart.at)

    def test_a_study_without_one_has_no_such_file(self, first):
        assert "validation/errors.csv" in first
        assert not [name for name in first if "compare" in name]

    def test_fewer_ranges_in_common(self, folder):
        """Beyond b = 2.9, where no run of 20 may lie, nothing is measured; the cells are empty."""
        config = config_text(more=COMPARE + "[factors]\nb = { low = 2.999, high = 30.0 }\n")
        (folder / "study.toml").write_text(config, encoding="utf-8")
        outcome = pipeline.run(folder / "study.toml", folder / "out", SMALL)
        found = outcome.comparisons["before"]
        assert (found.n_runs, found.n_outside) == (0, 20)
        text = (outcome.path / "validation" / "compare_before.csv").read_text(encoding="utf-8")
        row = next(csv.DictReader(text.splitlines()))
        assert (row["n_runs"], row["apart_max_abs"], row["range"], row["apart_most_b[mm]"]) == ("0", "", "", "")


class TestReport:
    def test_says_how_far_apart(self, folder, monkeypatch):
        """Their model, changed so that u is 10 % steeper in a: by 0.2 at most, of a range of some 9 m."""
        model = json.loads((folder / "old" / "model.json").read_text(encoding="utf-8"))
        model["coefficients"]["u"][model["terms"].index("a")] *= 1.1
        model.pop("digest")
        changed(folder, json.dumps(model))
        (folder / "study.toml").write_text(
            config_text(more=COMPARE + "[factors]\na = { low = -2.0, high = 1.0 }\n"), encoding="utf-8"
        )
        outcome = pipeline.run(folder / "study.toml", folder / "out", SMALL)
        report(outcome, monkeypatch)
        text = page_of(outcome).text
        assert "Beside another model: before" in text
        assert "study study; oracle counted" in text
        found = outcome.comparisons["before"]
        assert found.n_outside > 0
        assert "compared in the box that they have in common, a −1 to 1 N, b 1 to 3 mm" in text
        assert f"{found.n_outside} of the fresh runs lie beyond it" in text
        assert f"At the settings of the {found.n_runs} fresh runs" in text
        assert f"apart by {100 * found.apart[0].relative:.3g} % at most, in u" in text
        assert "validation/compare_before.csv" in text
        # d u / d a = 2 + 0.1 b at b = 2, and in theirs 10 % more, in µm/N
        assert "2200000 2420000 +10 %" in text

    def test_says_that_nothing_was_measured(self, folder, monkeypatch):
        config = config_text(more=COMPARE + "[factors]\nb = { low = 2.999, high = 30.0 }\n")
        (folder / "study.toml").write_text(config, encoding="utf-8")
        outcome = pipeline.run(folder / "study.toml", folder / "out", SMALL)
        report(outcome, monkeypatch)
        assert "No fresh run lies in that box" in page_of(outcome).text


class TestConfig:
    def test_the_model_is_taken_over_and_survives_a_round_trip(self, folder):
        config = load_config(folder / "study.toml")
        assert config.compare[0].text == (folder / "old" / "model.json").read_text(encoding="utf-8")
        assert parse_config(dump_config(config)) == config

    def test_names_must_differ(self, folder):
        (folder / "study.toml").write_text(
            config_text(more=COMPARE + COMPARE.replace("before", "Before")), encoding="utf-8"
        )
        refused(folder, r"compare\.Before: the name is used twice; names must differ by more than capitals")

    def test_a_model_of_something_else(self, folder):
        changed(folder, dumps(hexflex_like()))
        refused(folder, r"compare\.before: old/model\.json: it has the factors .*, the study has a \[N\], b \[mm\]")

    def test_ranges_with_nothing_in_common(self, folder):
        config = config_text(more=COMPARE + "[factors]\nb = { low = 3.0, high = 4.0 }\n")
        (folder / "study.toml").write_text(config, encoding="utf-8")
        refused(folder, r"compare\.before: old/model\.json: its range of b is 1 to 3 mm, that of the study 3 to 4")

    def test_a_model_that_was_changed(self, folder):
        text = dumps(load(folder / "old" / "model.json"))
        changed(folder, text.replace('"high": 20.0', '"high": 21.0'))
        refused(folder, r"compare\.before: old/model\.json: the model was changed after it was written")

    @pytest.mark.parametrize(
        ("model", "match"),
        [
            ("old/none.json", r"compare\.before: there is no file old/none\.json"),
            ("../model.json", r"compare\.before: .*\.\."),
            ("old/link.json", r"compare\.before: old/link\.json leads out of its folder"),
            ("old", r"compare\.before: old is no plain file"),
            ("old/bytes.json", r"compare\.before: old/bytes\.json is not UTF-8 text"),
            ("old/words.json", r"compare\.before: old/words\.json: not valid JSON"),
        ],
    )
    def test_a_bad_file(self, folder, model, match):
        (folder / "old" / "link.json").symlink_to("/etc/hostname")
        (folder / "old" / "bytes.json").write_bytes(b"\xff\xfe")
        (folder / "old" / "words.json").write_text("words", encoding="utf-8")
        (folder / "study.toml").write_text(config_text(more=COMPARE.replace("old/model.json", model)), encoding="utf-8")
        refused(folder, match)

    def test_an_absolute_path(self, folder):
        path = str(folder / "old" / "model.json")
        (folder / "study.toml").write_text(config_text(more=COMPARE.replace("old/model.json", path)), encoding="utf-8")
        refused(folder, r"compare\.before: ")

    def test_an_unknown_key_and_a_bad_name(self):
        with pytest.raises(InputError, match=r"unknown key 'compare\.0\.mdoel'; did you mean 'model'\?"):
            parse_config(config_text(more=COMPARE + 'mdoel = "x"\n'))
        with pytest.raises(InputError, match=r"compare\.0\.name should be letters, digits and underscores"):
            parse_config(config_text(more=COMPARE.replace("before", "../up")))

    def test_a_config_that_has_no_file(self, counted):
        with pytest.raises(
            InputError, match=r"compare\.before: old/model\.json was not read; load the config from its"
        ):
            resolve(parse_config(config_text(more=COMPARE)))

    def test_none_with_a_setting(self, folder):
        assert load_config(folder / "study.toml", ["compare=[]"]).compare == []
        assert tomllib.loads(dump_config(parse_config(config_text())))["compare"] == []


class TestTheBeamsBesideTheShells:
    """The models in configs/hexflex_calculix; to mend: the command at the head of the .toml beside each."""

    FOLDER = cases.CONFIGS / "hexflex_calculix"

    def test_the_linear_one_is_what_its_command_gives(self):
        """A linear oracle fitted with linear terms: whatever the runs, the model is the oracle's map to rounding."""
        given, study = load(self.FOLDER / "beams_linear.json"), resolve(load_config(self.FOLDER / "beams_linear.toml"))
        assert (given.factors, given.responses) == (study.space, study.oracle.responses)
        assert given.is_affine_map
        rest = np.zeros((1, 6))
        slopes = study.oracle.jacobian(rest)[0]  # compiled for tests/experiments/test_shells.py as well
        row = np.abs(slopes).max(axis=1, keepdims=True)
        assert_allclose(given.jacobian(rest)[0] / row, slopes / row, rtol=1e-9, atol=1e-9)
        assert_allclose(given.predict(rest)[0] / row[:, 0], 0.0, atol=1e-9)

    def test_the_nonlinear_one_belongs_to_its_config_and_to_the_linear_one(self):
        """To solve for it takes a quarter of a minute of compiling: its origin is held to the config, and its slopes
        at rest to the linear map. The best quadratic on ±1 N is up to 1.4 % off there; shells are by 4 to 6 %."""
        given, linear = load(self.FOLDER / "beams.json"), load(self.FOLDER / "beams_linear.json")
        study = resolve(load_config(self.FOLDER / "beams.toml"))
        expected = provenance(study, study.space.names)
        keys = ("study", "oracle", "oracle_version", "oracle_parameters", "seed", "kept_factors")
        assert {key: given.provenance[key] for key in keys} == {key: expected[key] for key in keys}
        assert (given.factors, given.responses) == (study.space, study.oracle.responses)
        assert not given.is_affine
        rest = np.zeros((1, 6))
        slopes = linear.jacobian(rest)[0]
        assert_allclose(given.jacobian(rest)[0], slopes, rtol=0.02, atol=1e-9 * np.abs(slopes).max())

    @pytest.mark.parametrize(
        ("name", "kind"), [("hexflex_calculix", "nonlinear"), ("hexflex_calculix_linear", "linear")]
    )
    def test_they_have_the_dimensions_of_the_shells(self, name, kind):
        """And the settings of the study beside which they are shown."""
        shells, sheet = resolve(load_config(cases.CONFIGS / f"{name}.toml")), Sheet()
        (file,) = (table.model for table in shells.config.compare)
        beams = load_config((cases.CONFIGS / file).with_suffix(".toml"))
        parameters = resolve(beams).oracle.parameters
        assert {f.name: getattr(sheet, f.name) for f in fields(sheet)} == {
            f.name: parameters[f.name] for f in fields(sheet)
        }
        assert parameters["kinematics"] == kind
        assert (beams.seed, beams.fit, beams.screening) == (
            shells.config.seed, shells.config.fit, shells.config.screening,
        )  # fmt: skip
