"""What settings of a program are refused, and with which sentence: templates, units, paths, patterns, variables."""

import math
import os
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments import Factor, FactorSpace, oracles
from experiments.oracles.command import CommandOracle
from experiments.oracles.command.checks import plain_relative
from experiments.oracles.command.folder import Unreadable, WorkFolder, read_inside
from experiments.oracles.command.template import DoesNotFit, Template
from experiments.oracles.command.units import convert, ratio
from tests.experiments.command_cases import PYTHON, made, once, settings

SPACE = FactorSpace((Factor("length", "m", 0.0, 1.0), Factor("T1D1", "N", -1.0, 1.0), Factor("turn", "rad", -1.0, 1.0)))
POINT = (0.0003, 1 / 3, math.pi / 6)


def filled(text, point=POINT):
    return Template.parse("template", text, SPACE).fill(point)


class TestTemplates:
    @pytest.mark.parametrize(
        ("text", "expected"),
        [
            ("{{T1D1}}", repr(1 / 3)),
            ("a={{ T1D1 }},b", f"a={1 / 3!r},b"),
            ("{{length [mm]}}", "0.3"),
            ("{{length[µm]}}", "300.0"),
            ("{{turn [deg]:.6f}}", "30.000000"),
            ("{{T1D1 [mN]:+.3e}}", "+3.333e+02"),
            ("{{T1D1:12.5E}}|", " 3.33333E-01|"),
            ("{{T1D1:08.3f}}", "0000.333"),
            ("{{T1D1:.3g}}{{length:.0e}}", "0.3333e-04"),
            ("*NODE\r\n1, {length}, {T1D1}, }}\r\n", "*NODE\r\n1, {length}, {T1D1}, }}\r\n"),
            ("set p {{{T1D1:.1f}}}", "set p {0.3}"),
            ("", ""),
        ],
    )
    def test_numbers_are_written_as_asked(self, text, expected):
        assert filled(text) == expected

    @given(st.floats(allow_nan=False, allow_infinity=False))
    def test_without_a_format_every_number_reads_back(self, value):
        assert float(filled("{{T1D1}}", (0.0, value, 0.0))) == value

    @pytest.mark.parametrize(
        ("text", "match"),
        [
            ("a\nb {{T1D2}}", r"template, line 2, \{\{T1D2\}\}: unknown factor 'T1D2'; did you mean 'T1D1'\?"),
            ("{{length [N]}}", r"'m' and 'N' measure different things"),
            ("{{length [furlong]}}", r"unknown unit 'furlong' in 'furlong'; known are 1, m, g"),
            ("{{T1D1:s}}", r"the format 's' is not allowed; use e, f or g"),
            ("{{T1D1:.99f}}", r"the format '.99f' is not allowed"),
            ("{{T1D1:99f}}", r"the format '99f' is not allowed"),
            ("{{T1D1:x<9e}}", r"the format 'x<9e' is not allowed"),
            ("{{T1D1!r}}", r"line 1: '\{\{T1D1!r\}\}' is no placeholder; write \{\{name\}\}"),
            ("{{T1D1.__class__}}", r"is no placeholder"),
            ("{{T1D1 + 1}}", r"is no placeholder"),
            ("{{}}", r"is no placeholder"),
            ("\n\n{{ 1, 2 }, { 3, 4 }}", r"template, line 3: '\{\{ 1, 2 \}, \{ 3, 4 \}\}' is no placeholder"),
            ("{{folder}}", r"unknown factor 'folder'"),
        ],
    )
    def test_what_is_refused(self, text, match):
        with pytest.raises(ValueError, match=match):
            filled(text)

    @given(st.text(alphabet="{}T1D1length[m]: .6eNx\n!%", max_size=40))
    def test_whatever_is_written_is_filled_or_refused(self, text):
        try:
            template = Template.parse("template", text, SPACE)
        except ValueError:
            return
        literal = "".join(p for p in template.pieces if isinstance(p, str))
        assert "{{" not in text or template.names
        assert len(template.fill(POINT)) >= len(literal)

    @pytest.mark.parametrize("value", [math.nan, math.inf])
    def test_what_is_not_finite_is_not_written(self, value):
        with pytest.raises(DoesNotFit, match=r"length = (nan|inf) is not finite"):
            filled("{{length}}", (value, 0.0, 0.0))

    def test_a_factor_that_nothing_names(self):
        with pytest.raises(
            ValueError, match=r"no template and no argument names the factor 'b': write \{\{b\}\} where"
        ):
            made(None, argv=["true", "{{a}}"])

    def test_a_factor_that_a_template_alone_names(self, tmp_path):
        oracle = made(
            tmp_path, "print('y =', open('in/b.txt').read())\n",
            argv=[*PYTHON, "program.py", "{{a}}", "0"], templates={"in/b.txt": {"text": "{{b [mN]}}"}},
        )  # fmt: skip
        assert once(oracle) == ("ok", "", 500.0)


class TestUnits:
    @pytest.mark.parametrize(
        ("given", "wanted", "expected"),
        [
            ("m", "mm", 1000), ("N", "kN", Fraction(1, 1000)), ("Pa", "MPa", Fraction(1, 10**6)),
            ("Pa", "N/mm^2", Fraction(1, 10**6)), ("N*m", "N*mm", 1000), ("N m", "mJ", 1000),
            ("kg", "t", Fraction(1, 1000)),
            ("kg/m^3", "t/mm^3", Fraction(1, 10**12)), ("kg/m³", "g/cm3", Fraction(1, 1000)), ("1/s", "Hz", 1),
            ("N/m", "mN/um", Fraction(1, 1000)), ("m^-1", "1/mm", Fraction(1, 1000)), ("in", "mm", Fraction(254, 10)),
            ("1", "%", 100), ("furlong", "furlong", 1), ("rad", "mrad", 1000), ("W", "N m/s", 1), ("V", "mV", 1000),
        ],
    )  # fmt: skip
    def test_ratios_are_exact(self, given, wanted, expected):
        assert ratio(given, wanted) == expected
        assert ratio(wanted, given) == 1 / Fraction(expected)

    def test_degrees(self):
        assert convert(math.pi, ratio("rad", "deg")) == 180.0
        assert convert(90.0, ratio("°", "rad")) == math.pi / 2

    @pytest.mark.parametrize(
        ("given", "wanted"),
        [
            ("m", "N"),
            ("rad", "1"),
            ("m", "m^2"),
            ("m", "kin"),
            ("m", "mkm"),
            ("m", "m**2"),
            ("1", "12"),
            ("m", "m0"),
            ("m", "°C"),
        ],
    )
    def test_what_has_none(self, given, wanted):
        with pytest.raises(ValueError, match=r"measure different things|unknown unit"):
            ratio(given, wanted)

    @given(st.floats(allow_nan=False, allow_infinity=False))
    def test_a_product_is_rounded_once(self, value):
        found = convert(value, Fraction(1000))
        assert found == value * 1000.0, "by a whole number, floating-point multiplication rounds once as well"

    def test_the_response_is_stored_in_its_unit(self, tmp_path):
        responses = {"y": {"unit": "m", "file_unit": "mm", "scale": -2.0, "regex": r"y = (\S+)"}}
        assert once(made(tmp_path, responses=responses))[2] == -0.004


HOSTILE = [
    "../x", "/etc/x", "a/../x", "..", ".", "", "a//b", "a/", "~/x", "a\\b", "C:/x", ".bashrc", "a/.ssh", "x\n", "x\0",
    "-rf", "a b", "$(x)", "é", "stdout.txt", "STDERR.TXT", "a/" * 9 + "b", "x" * 201,
]  # fmt: skip


class TestPaths:
    @pytest.mark.parametrize("which", ["templates", "files"])
    @pytest.mark.parametrize("name", HOSTILE)
    def test_hostile_names_are_refused(self, which, name):
        with pytest.raises(ValueError, match=r"file name .* is not allowed: use a relative path|cannot both be called"):
            made(None, **{which: {name: {"text": "x"}}})

    @pytest.mark.parametrize("name", [n for n in HOSTILE if n.lower() not in ("stdout.txt", "stderr.txt")])
    def test_hostile_names_are_not_read(self, name):
        with pytest.raises(ValueError, match=r"response 'y': file .* is not allowed"):
            made(None, responses={"y": {"unit": "m", "file": name, "regex": "(x)"}})

    @given(st.text())
    def test_what_is_allowed_stays_inside(self, name):
        try:
            plain_relative("name", name)
        except ValueError:
            return
        assert os.path.normpath(f"/work/{name}") == f"/work/{name}"

    @pytest.mark.parametrize("target", ["/etc/passwd", "../../secret", "loop", "/dev/zero"])
    def test_a_link_that_the_program_makes_is_not_followed_out(self, target, tmp_path):
        (tmp_path / "secret").write_text("y = 7\n")
        responses = {"y": {"unit": "m", "file": "loop", "regex": r"(\d+)"}}
        status, reason, _ = once(made(tmp_path, f"os.symlink({target!r}, 'loop')", responses=responses))
        assert status == "crashed"
        assert "leads out of its folder" in reason or "cannot read loop" in reason

    def test_nor_a_folder_that_is_a_link(self, tmp_path):
        (tmp_path / "secret").write_text("y = 7\n")
        responses = {"y": {"unit": "m", "file": "up/secret", "regex": r"(\d+)"}}
        _, reason, _ = once(made(tmp_path, f"os.symlink({str(tmp_path)!r}, 'up')", responses=responses))
        assert "up/secret leads out of its folder" in reason

    def test_a_link_that_stays_inside_is(self, tmp_path):
        script = "open('result.007', 'w').write('y = 7')\nos.symlink('result.007', 'result')\n"
        responses = {"y": {"unit": "m", "file": "result", "regex": r"y = (\d+)"}}
        assert once(made(tmp_path, script, responses=responses))[2] == 7.0

    @pytest.mark.parametrize(
        ("make", "said"),
        [
            ("os.mkfifo('r')", "is no plain file"),
            ("os.mkdir('r')", "no plain file"),
            ("open('r', 'wb').truncate(10 * 2**30)", "has 10737418240 bytes; at most"),
        ],
    )
    def test_a_pipe_does_not_block_and_a_folder_is_no_file(self, make, said, tmp_path):
        responses = {"y": {"unit": "m", "file": "r", "regex": r"(\d+)"}}
        assert said in once(made(tmp_path, make, responses=responses))[1]

    def test_printing_into_a_link_is_not_read_either(self, tmp_path):
        script = "os.remove('stdout.txt')\nos.symlink('/etc/passwd', 'stdout.txt')"
        status, reason, _ = once(made(tmp_path, script))
        assert status == "crashed"
        assert "root:" not in reason

    def test_files_are_never_written_over(self, tmp_path):
        folder = WorkFolder.make(str(tmp_path), "p")
        (folder.path / "link").symlink_to(tmp_path / "elsewhere")
        folder.write("in/one", "1")
        for name in ("link", "in/one"):
            with pytest.raises(FileExistsError):
                folder.write(name, "2")
        assert not (tmp_path / "elsewhere").exists()
        assert read_inside(folder.path, "in/one") == b"1"

    def test_what_is_not_there(self, tmp_path):
        with pytest.raises(Unreadable, match="there is no file x"):
            read_inside(tmp_path, "x")


class TestProgram:
    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"argv": []}, r"argv needs the program and its arguments"),
            ({"argv": "rm -rf {{a}}"}, r"argv must be list or tuple, got 'rm -rf"),
            ({"argv": ["x", 1]}, r"argv must be a list of texts"),
            ({"argv": ["a\0b"]}, r"argv must be a list of texts"),
            ({"argv": ["{{a}}"]}, r"argv: the program must be stated as it is"),
            ({"argv": ["{{folder}}/x"]}, r"argv: the program must be stated as it is"),
            ({"argv": ["./x", "{{a}}"]}, r"argv: the program must be a name on PATH, an absolute path"),
            ({"argv": ["x", "{{c}}"]}, r"argv\[1\], line 1, \{\{c\}\}: unknown factor 'c'"),
            ({"argv": ["x", "{{folder:.3f}}"]}, r"'folder' is a text and takes no unit or format"),
            ({"time_limit": 0.0}, r"time_limit must be above 0"),
            ({"time_limit": math.inf}, r"time_limit must be finite"),
            ({"grace": -1.0}, r"grace must be 0 to 600"),
            ({"retries": -1}, r"retries must be 0 to 100"),
            ({"retries": 1.5}, r"retries must be a whole number"),
            ({"exit_codes": [True]}, r"exit_codes must be whole numbers from 0 to 255"),
            ({"keep": "some"}, r"keep must be one of failed, all, none, got 'some'"),
            ({"keeep": "all"}, r"oracle 'command' has no setting 'keeep'; did you mean 'keep'\?"),
            ({"resolution": 1.0}, r"resolution must be at least 0"),
            ({"factors": {}}, r"at least one factor"),
            ({"responses": {}}, r"needs at least one response"),
            ({"factors": {"a": 1}}, r"factors must be a table with a table for every name"),
            ({"factors": {"a": {"unit": "m", "low": 1.0}}}, r"factor 'a' needs the setting 'high'"),
            ({"factors": {"folder": {"unit": "m", "low": 0.0, "high": 1.0}}}, r"no factor may be called 'folder'"),
            ({"factors": {"y": {"unit": "m", "low": 0.0, "high": 1.0}}}, r"no factor may be called 'y', which is"),
            ({"files": {"x": {"file": "x"}}}, r"files: 'x' needs its text"),
            ({"files": {"x": {"text": "", "mode": "755"}}}, r"files: 'x' has no setting 'mode'"),
            ({"files": {"x": {"text": ""}}, "templates": {"X": {"text": ""}}}, r"two files cannot both be called 'x'"),
        ],
        ids=str,
    )  # fmt: skip
    def test_what_is_refused(self, change, match):
        with pytest.raises(ValueError, match=match):
            made(None, **change)

    @pytest.mark.parametrize(
        "name",
        ["LD_PRELOAD", "ld_library_path", "DYLD_INSERT_LIBRARIES", "PYTHONPATH", "PYTHONSTARTUP", "PATH", "ENV",
         "BASH_ENV", "PERL5OPT", "RUBYOPT", "NODE_OPTIONS", "JAVA_TOOL_OPTIONS", "IFS", "HOME", "GIT_SSH_COMMAND"],
    )  # fmt: skip
    def test_variables_that_would_run_something_else(self, name):
        with pytest.raises(
            ValueError, match=f"{name} may not be set here, because it can make a program run something"
        ):
            made(None, environment={name: "x"})

    @pytest.mark.parametrize(
        ("change", "match"),
        [
            ({"environment": {"A=B": "x"}}, r"variable name 'A=B' is not allowed"),
            ({"environment": {"A": "x\ny"}}, r"A must be a text of printable characters"),
            ({"environment": {"A": 1}}, r"A must be a text"),
            ({"inherit": ["A B"]}, r"variable name 'A B' is not allowed"),
            ({"inherit": "PATH"}, r"inherit must be list or tuple"),
        ],
    )
    def test_variables(self, change, match):
        with pytest.raises(ValueError, match=match):
            made(None, **change)

    @pytest.mark.parametrize(
        ("regex", "match"),
        [
            ("(", r"is no regular expression: missing \)"),
            ("x", r"needs 1 group in parentheses, around the number; it has 0"),
            ("(x)(y)", r"it has 2"),
            ("((a+)+)$", r"repeats a repetition, which may take for ever"),
            (r"(\d*)*x", r"repeats a repetition"),
            (r"(?:(?:a|b)*c)+(x)", r"repeats a repetition"),
            ("(x)" + "y" * 1000, r"a pattern of 1003 characters is too long"),
        ],
    )
    def test_patterns(self, regex, match):
        with pytest.raises(ValueError, match=match):
            made(None, responses={"y": {"unit": "m", "regex": regex}})
        with pytest.raises(ValueError, match=r"rejected_if: .*(no regular|repeats)"):
            made(None, rejected_if="(a+)+b")

    @pytest.mark.parametrize("regex", [r"disp\s*=\s*([-+.\deE]+)", r"^ *17 +(\S+)", r"(?:x)?(\d+)", "a{3}(b+)"])
    def test_patterns_that_are_fine(self, regex):
        assert made(None, responses={"y": {"unit": "m", "regex": regex}})

    def test_an_oracle_without_settings_says_how_to_give_some(self):
        with pytest.raises(ValueError, match=r"argv needs the program"):
            oracles.get("command")
        with pytest.raises(ValueError, match=r"is made by oracles\.get"):
            CommandOracle(None)  # type: ignore[arg-type]

    def test_settings_are_not_shared_with_who_gave_them(self):
        given = settings()
        oracle = oracles.get("command", **given)
        before = str(oracle.parameters)
        given["argv"].append("more")
        given["responses"]["y"]["regex"] = "(z)"
        assert str(oracle.parameters) == before
