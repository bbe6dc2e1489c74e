"""The report: one file that needs no other, with the study's numbers in it, whatever the study."""

import base64
import json
import re
import shutil
from dataclasses import replace
from html.parser import HTMLParser
from xml.etree import ElementTree

import numpy as np
import pytest

import pipeline
from experiments.designs import level_discrepancy_squared
from pipeline import InputError, Outcome, read_run
from pipeline.cli import main
from pipeline.report import report_html
from pipeline.report.validation import error_rows
from pipeline.report.views import number, percent
from tests.pipeline.cases import SMALL, config_text

VOID = {"meta", "img", "br", "link", "input", "hr"}
LOADING = {"src", "href", "srcset", "data", "poster", "action", "background", "xlink:href"}


class Page(HTMLParser):
    """A parsed page: its elements, attributes, text, scripts and styles; complains of what is not closed."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.parts: dict[str, str] = {"text": "", "script": "", "style": "", "title": ""}
        self.open: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == [], f"not closed: {self.open}"

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, {k: v or "" for k, v in attrs}))
        if tag not in VOID:
            self.open.append(tag)
        elif tag == "br":
            self.handle_data(" ")

    def handle_endtag(self, tag):
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag
        if tag not in {"strong", "code", "a", "sup", "span"}:
            self.handle_data(" ")

    def handle_data(self, data):
        inner = self.open[-1] if self.open else ""
        self.parts[inner if inner in self.parts else "text"] += data

    @property
    def text(self) -> str:
        return " ".join(self.parts["text"].split())

    def values(self, names: set[str]) -> list[str]:
        return [v for _, attributes in self.elements for k, v in attributes.items() if k in names]

    def count(self, tag: str) -> int:
        return sum(t == tag for t, _ in self.elements)

    def ids(self) -> list[str]:
        return [a["id"] for _, a in self.elements if "id" in a]


def page_of(outcome: Outcome) -> Page:
    return Page((outcome.path / "report.html").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def pages(smoke, hexflex) -> dict[str, Page]:
    return {"smoke": page_of(smoke), "hexflex": page_of(hexflex)}


@pytest.fixture(params=["smoke", "hexflex"])
def page(request, pages) -> Page:
    return pages[request.param]


@pytest.fixture
def outcome_of(counted, tmp_path):
    """Run a study of one of the test oracles, with its report."""

    def run(oracle: str, *overrides: str) -> Outcome:
        config = tmp_path / "study.toml"
        config.write_text(config_text(oracle), encoding="utf-8")
        return pipeline.run(config, tmp_path / "out", [*SMALL, *overrides])

    return run


class TestSelfContained:
    def test_loads_nothing(self, page):
        for value in page.values(LOADING):
            assert re.match(r"data:image/svg\+xml;base64,|#", value), value[:80]
        assert page.count("link") == page.count("iframe") == page.count("object") == page.count("base") == 0
        for found in re.findall(r"url\(([^)]*)\)|@import\s*(\S*)", page.parts["style"]):
            assert found[0].strip("\"' ").startswith("data:"), found
        assert all("url(" not in style or "data:" in style for style in page.values({"style"}))

    def test_its_script_fetches_nothing(self, page):
        words = r"\bfetch\b|XMLHttpRequest|WebSocket|importScripts|\bimport\b|sendBeacon|EventSource|\.src\b|\beval\b"
        assert not re.search(words, page.parts["script"])

    def test_its_figures_are_well_formed_and_load_nothing(self, page):
        figures = [v for v in page.values({"src"}) if v.startswith("data:image/svg+xml;base64,")]
        assert len(figures) >= 5
        for figure in figures:
            root = ElementTree.fromstring(base64.b64decode(figure.partition(",")[2], validate=True))
            assert root.tag == "{http://www.w3.org/2000/svg}svg"
            for element in root.iter():
                for key, value in element.attrib.items():
                    if key.endswith("href"):
                        assert value.startswith(("#", "data:")), value[:80]
                    assert "url(" not in value or "url(#" in value

    def test_names_no_file_of_this_machine(self, page, smoke, hexflex):
        everything = page.text + page.parts["script"] + " ".join(page.values({"alt", "title", "href"}))
        for outcome in (smoke, hexflex):
            assert str(outcome.path.parent) not in everything


class TestIsHtml:
    def test_has_one_of_each(self, page):
        for tag in ("html", "head", "body", "title", "h1", "main"):
            assert page.count(tag) == 1
        assert ("meta", {"charset": "utf-8"}) in page.elements

    def test_links_lead_somewhere(self, page):
        ids = page.ids()
        assert len(ids) == len(set(ids))
        targets = [v[1:] for v in page.values({"href"})]
        assert len(targets) >= 6
        assert set(targets) <= set(ids)

    def test_every_picture_has_words(self, page):
        assert all(a.get("alt") for tag, a in page.elements if tag == "img")


class TestContent:
    @pytest.mark.parametrize("which", ["smoke", "hexflex"])
    def test_has_the_numbers_of_the_validation(self, which, pages, request):
        outcome, text = request.getfixturevalue(which), pages[which].text
        for errors in (outcome.model.validation, outcome.round_trip.errors):
            for error, response in zip(errors, outcome.model.responses, strict=True):
                shown = [number(error.max_abs * response.shown_scale, 3), percent(error.max_relative)]
                assert " ".join(shown[:1]) in text
                assert shown[1] in text
                assert number(error.rmse * response.shown_scale, 3) in text
                assert f"{response.symbol} [{response.shown_unit}]" in text
        for row in error_rows(outcome, outcome.model.validation):
            cells = ("max_abs", "range", "relative", "rmse", "relative_rmse", "q2", "worst")
            assert f"{row['symbol']} [{row['unit']}] {' '.join(row[c] for c in cells)}" in text

    @pytest.mark.parametrize(("which", "levels"), [("smoke", 1), ("hexflex", 3)])
    def test_has_the_intervals_with_the_coverage_measured(self, which, levels, pages, request):
        model, text = request.getfixturevalue(which).model, pages[which].text
        n = model.validation[0].n_runs
        assert f"{n // 2} of the fresh runs set the half-widths h; measured is the share of the other {n // 2}" in text
        for error, response in zip(model.validation, model.responses, strict=True):
            assert len(error.intervals) == levels
            cells = [(number(i.half_width * response.shown_scale, 3), percent(i.coverage)) for i in error.intervals]
            row = " ".join(part for cell in cells for part in cell)
            assert f"{response.symbol} [{response.shown_unit}] {row}" in text
        assert ("An interval of 99 % takes 197 fresh runs or more." in text) == (levels < 3)

    def test_says_where_the_largest_error_lies(self, smoke):
        space = smoke.model.factors
        low, high = (np.array([getattr(f, end) for f in space]) for end in ("low", "high"))
        mixed = np.where([True, False, False, True], low, space.centre)
        for point, words in (
            (space.centre, "in the interior"),
            (mixed, "near low length, low load"),
            (high, "near high length, high width, high thickness, high load (a corner)"),
            ((), "–"),
        ):
            errors = [replace(e, worst_point=tuple(point)) for e in smoke.model.validation]
            assert [row["worst"] for row in error_rows(smoke, errors)] == [words] * 2

    @pytest.mark.parametrize(
        ("q2", "words"),
        [(None, "–"), (1.0, "1"), (1.0 - 2.0**-20, "1 − 9.5·10⁻⁷"), (0.98765, "0.988"), (-3.0, "−3"), (-np.inf, "–")],
    )
    def test_says_what_is_missing_of_q2(self, q2, words, smoke):
        row = error_rows(smoke, [replace(smoke.model.validation[0], q2=q2)])[0]
        assert row["q2"] == words

    def test_of_a_model_from_before_q2_and_intervals(self, smoke_copy):
        file = smoke_copy / "model.json"
        document = json.loads(file.read_text(encoding="utf-8"))
        for error in document["validation"]:
            for name in ("relative_rmse", "q2", "worst_point", "intervals"):
                del error[name]
        del document["digest"]
        file.write_text(json.dumps(document), encoding="utf-8")
        assert main(["report", str(smoke_copy)]) == 0
        text = " ".join((smoke_copy / "report.html").read_text(encoding="utf-8").split())
        assert "There are none: half of the fresh runs set the width" in text
        assert text.count('<td>–</td><td>–</td><td class="text">–</td>') == 2

    @pytest.mark.parametrize("which", ["smoke", "hexflex"])
    def test_has_the_study(self, which, pages, request):
        outcome, page = request.getfixturevalue(which), pages[which]
        assert page.parts["title"] == outcome.study.config.title
        for factor in outcome.study.space:
            assert f"{factor.name} {factor.unit} {number(factor.low, 6)} {number(factor.high, 6)} yes yes" in page.text
        columns = [outcome.study.space.index(n) for n in outcome.kept]
        cd2 = level_discrepancy_squared(outcome.fit_runs.design.coded[:, columns])
        assert f"squared centred discrepancy {cd2:.6f}" in page.text
        n = len(outcome.validation_runs)
        assert f"{n - outcome.round_trip.n_refused} of {n}" in page.text
        assert f"seed {outcome.study.config.seed}" in page.text
        told = json.loads((outcome.path / "provenance.json").read_text(encoding="utf-8"))
        assert told["host"] in page.text
        assert told["started"] in page.text

    def test_of_the_hexflex_holds_published_against_ours(self, pages, hexflex):
        text = pages["hexflex"].text
        slope = 1e6 * hexflex.model.jacobian(hexflex.model.factors.centre[None])[0]
        published = hexflex.study.oracle.published
        for i in range(6):
            for j in range(6):
                theirs = 1e6 * published.values[i, j]
                if theirs:
                    assert f"{number(theirs, 7)}" in text
                    assert f"{number(slope[i, j], 7)} {number(100 * (slope[i, j] / theirs - 1), 2)} %" in text
        assert "Published against ours" in text
        assert len(published.notes) > 0
        for note in published.notes.values():
            assert " ".join(note.split()) in text
        assert f"condition {number(hexflex.model.certificate.condition, 3)}" in text
        assert "All that was required holds" in text

    def test_of_a_nonlinear_model_holds_coefficients_and_no_map(self, pages, smoke):
        page = pages["smoke"]
        assert not smoke.model.is_affine
        assert "Coefficients" in page.text
        assert "The map" not in page.text
        assert "Published against ours" not in page.text
        scale = [r.shown_scale for r in smoke.model.responses]
        shown, errors = smoke.model.coefficients * scale, smoke.model.standard_errors * scale
        assert (errors[shown != 0.0] > 0.0).all()
        for label, row, beside in zip(smoke.model.terms.labels, shown, errors, strict=True):
            cells = " ".join(
                f"{number(v, 5)} ± {number(e, 2)}" for v, e in zip(row, beside, strict=True) if v != 0.0
            )  # fmt: skip
            assert f"{label} {cells}" in page.text

    def test_draws_the_mechanism(self, page):
        shapes = json.loads(re.search(r"\[\{.*\}\]", page.parts["script"]).group())
        assert len(shapes) >= 5
        for shape in shapes:
            assert shape["lines"]
            for line in shape["lines"]:
                assert len(line["rest"]) == len(line["move"]) >= 2
            assert any(abs(v) > 0 for line in shape["lines"] for p in line["move"] for v in p)
        assert "viewer" in page.ids()

    @pytest.mark.parametrize(
        ("value", "text"),
        [
            (0.0, "0"), (-0.0, "0"), (57.5, "57.5"), (-3101.8, "−3102"), (1e-3, "0.001"), (1.25e-9, "1.25·10⁻⁹"),
            (-2e12, "−2·10¹²"), (float("nan"), "–"), (float("inf"), "–"), (100.0, "100"), (1234567.0, "1234567"),
            (9.9996, "10"), (0.99996, "1"), (9.9999e-13, "1·10⁻¹²"),
        ],
    )  # fmt: skip
    def test_numbers_for_people(self, value, text):
        """Four significant digits, a true minus sign, no zeros that say nothing."""
        shown = number(value)
        assert shown.replace(".00·", "·").replace(".0·", "·") == text


HOSTILE = "<script>alert(1)</script><img src=\"x\" onerror='alert(2)'>&amp;{{ 7 * 7 }}</title></script>"


class TestEscapes:
    def test_a_hostile_title_is_text(self, smoke, pages):
        config = smoke.study.config.model_copy(update={"title": HOSTILE})
        outcome = replace(smoke, study=replace(smoke.study, config=config))
        html = report_html(outcome, json.loads((smoke.path / "provenance.json").read_text(encoding="utf-8")))
        assert HOSTILE not in html
        page = Page(html)
        assert page.parts["title"] == HOSTILE
        for tag in ("script", "img", "title"):
            assert page.count(tag) == pages["smoke"].count(tag)

    def test_a_hostile_host_is_text(self, smoke, pages):
        told = json.loads((smoke.path / "provenance.json").read_text(encoding="utf-8"))
        page = Page(report_html(smoke, told | {"host": HOSTILE, "platform": HOSTILE}))
        assert page.text.count("alert(1)") == 2
        assert page.count("script") == pages["smoke"].count("script")

    def test_a_hostile_reason_is_text(self, counted, outcome_of):
        def trouble(point):
            if point[3] == 15.0 and point[0] > 0.9:
                raise ArithmeticError(HOSTILE)

        counted.trouble = staticmethod(trouble)
        page = page_of(outcome_of("counted", "oracle.max_failed_fraction=0.3", "fit.design.n_runs=24"))
        assert "alert(1)" not in page.parts["script"]


class TestOtherStudies:
    def test_an_oracle_without_shape_or_published_map(self, outcome_of):
        outcome = outcome_of("counted")
        page = page_of(outcome)
        assert not outcome.model.is_affine
        assert "viewer" not in page.ids()
        assert "published" not in page.ids()
        assert "Published against ours" not in page.text
        assert "d 1 10 20 no no" in page.text
        for value in page.values({"src"}):
            assert value.startswith("data:image/svg+xml;base64,")

    def test_a_response_that_never_moves(self, outcome_of):
        page = page_of(outcome_of("one_still"))
        assert "nan" not in page.text.lower().replace("nano", "").split()
        assert "inf" not in page.text.lower().split()

    def test_no_response_that_moves(self, outcome_of):
        page = page_of(outcome_of("all_still", 'screening.keep=["a"]'))
        assert "nan" not in page.text.lower().split()

    @pytest.mark.parametrize(
        ("setting", "words"),
        [
            ("fit.trim=true", "terms were removed until those left are what the data support"),
            ("fit.trim=false", "all were kept"),
            ('fit.selection="forward"', "terms entered one at a time"),
        ],
    )
    def test_says_how_terms_were_chosen(self, setting, words, outcome_of):
        assert words in page_of(outcome_of("counted", setting)).text

    def test_every_target_refused(self, outcome_of):
        page = page_of(outcome_of("unreachable", "fit.degree=1"))
        assert "0 of 20" in page.text
        assert "20 were refused" in page.text

    def test_a_requirement_that_does_not_hold(self, smoke):
        outcome = replace(smoke, shortfalls=("slope: too <large>",))
        page = Page(report_html(outcome, json.loads((smoke.path / "provenance.json").read_text(encoding="utf-8"))))
        assert "Not everything that was required holds" in page.text
        assert "slope: too <large>" in page.text
        assert "All that was required holds" not in page.text


def _missing(data: bytes) -> None:
    return None


def _empty(data: bytes) -> bytes:
    return b""


def _garbage(data: bytes) -> bytes:
    return b"\xff\xfe\x00garbage"


def _word(data: bytes) -> bytes:
    return b"hello\n"


def _half(data: bytes) -> bytes:
    return data[: len(data) // 2]


def _fewer_lines(data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    return b"".join(lines[: len(lines) // 2])


def _nan(data: bytes) -> bytes:
    lines = data.splitlines(keepends=True)
    lines[2] = b"nan," + lines[2].partition(b",")[2]
    return b"".join(lines)


def _nothing_in_it(data: bytes) -> bytes:
    return b"{}"


DAMAGES = {
    "config.toml": [_missing, _empty, _garbage, _word, _half],
    "provenance.json": [_missing, _empty, _garbage, _word, _half, _nothing_in_it],
    "model.json": [_missing, _empty, _garbage, _word, _half, _nothing_in_it],
    **{
        f"{stage}/{name}.csv": [_missing, _empty, _garbage, _word, _half, _fewer_lines, _nan]
        for stage in ("screening", "fit", "validation", "inversion")
        for name in ("design", "runs")
    },
}


class TestDamagedFolder:
    @pytest.mark.parametrize(
        ("name", "damage"),
        [(name, damage) for name, damages in DAMAGES.items() for damage in damages],
        ids=lambda v: getattr(v, "__name__", v),
    )
    def test_is_refused_with_one_sentence(self, name, damage, smoke_copy, capsys):
        file = smoke_copy / name
        changed = damage(file.read_bytes())
        file.unlink()
        if changed is not None:
            file.write_bytes(changed)
        report = (smoke_copy / "report.html").read_bytes()
        assert main(["report", str(smoke_copy)]) == 2
        out, err = capsys.readouterr()
        assert out == ""
        assert err.startswith("flexdoce: ")
        assert err.count("\n") == 1, err
        assert "Traceback" not in err
        assert (smoke_copy / "report.html").read_bytes() == report, "the old report is gone"

    @pytest.mark.parametrize("name", [n for n in DAMAGES if n.endswith(".csv")])
    def test_the_sentence_names_the_file(self, name, smoke_copy):
        file = smoke_copy / name
        file.write_bytes(_word(b""))
        with pytest.raises(InputError, match=re.escape(name)):
            read_run(smoke_copy)

    def test_a_model_of_another_study_is_refused(self, smoke_copy, hexflex):
        shutil.copy(hexflex.path / "model.json", smoke_copy / "model.json")
        with pytest.raises(InputError, match=r"model\.json"):
            read_run(smoke_copy)

    def test_a_model_without_validation_is_refused(self, smoke_copy, capsys):
        file = smoke_copy / "model.json"
        document = json.loads(file.read_text(encoding="utf-8")) | {"validation": []}
        file.write_text(json.dumps(document), encoding="utf-8")
        assert main(["report", str(smoke_copy)]) == 2
        assert "model.json" in capsys.readouterr().err

    @pytest.mark.parametrize("stage", ["fit", "validation", "inversion"])
    def test_a_stage_that_lost_its_last_run_in_both_tables(self, stage, smoke_copy):
        """Tables that agree with each other, but not with the rest of the folder."""
        for name in ("design", "runs"):
            file = smoke_copy / stage / f"{name}.csv"
            lines = file.read_bytes().splitlines(keepends=True)
            file.write_bytes(b"".join(lines[:-1]))
        if stage == "fit":
            assert len(read_run(smoke_copy).fit_runs) == 29
            return
        with pytest.raises(InputError):
            read_run(smoke_copy)
