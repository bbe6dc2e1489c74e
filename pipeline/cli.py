"""The command line: parses arguments, calls the pipeline, prints. Every error is one sentence and an exit code."""

import argparse
import signal
import sys
from collections.abc import Callable, Sequence

from experiments.oracles import OracleError

from . import commands
from .compilation import keep_compiled
from .errors import FlexdoceError, InputError
from .points import FAILURES
from .version import __version__

EPILOG = (
    "exit codes: 0 done; 2 bad config or arguments; 3 too many failed runs; "
    "4 a declared requirement is not met; 1 the disk or the cluster failed, or a bug of ours; 130 stopped by Ctrl-C"
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    arguments = _parser().parse_args(argv)
    keep_compiled()
    try:
        return arguments.command(arguments) or 0
    except FlexdoceError as error:
        print(f"flexdoce: {error}", file=sys.stderr)
        return error.exit_code
    except OracleError as error:
        print(f"flexdoce: {InputError(str(error))}", file=sys.stderr)
        return InputError.exit_code
    except BrokenPipeError:
        return 0
    except OSError as error:
        # A full disk, a lost mount: not the config's fault and not a bug of ours.
        print(f"flexdoce: {error.filename or 'the disk'}: {error.strerror}; run the same command to continue",
              file=sys.stderr)  # fmt: skip
        return 1
    except KeyboardInterrupt as stop:
        print("flexdoce: stopped; run the same command to continue, no answer that came in is lost", file=sys.stderr)
        return 128 + (stop.args[0] if stop.args and isinstance(stop.args[0], int) else signal.SIGINT)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="flexdoce",
        description="From a simulator of a compliant mechanism to a small, invertible, trusted formula.",
        epilog=EPILOG,
    )
    parser.add_argument("--version", action="version", version=f"flexdoce {__version__}")
    verbs = parser.add_subparsers(title="commands", metavar="COMMAND", required=True)

    def verb(name: str, function: object, summary: str) -> argparse.ArgumentParser:
        sub = verbs.add_parser(name, help=summary, description=summary)
        sub.set_defaults(command=function)
        return sub

    for name, function, summary in (
        ("run", commands.run, "run a study, or continue it"),
        ("check", commands.check, "validate a config and print it as resolved; touches nothing"),
        ("plan", commands.plan, "print the designs of a study; runs nothing"),
    ):
        sub = verb(name, function, summary)
        sub.add_argument("config", metavar="CONFIG", help="config file, TOML")
        sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
                         help="replace a setting, such as fit.degree=3; repeatable")  # fmt: skip
        if name == "check":
            sub.add_argument("--load", action="store_true", help="load an oracle in a file, too: this runs the file")
        if name == "run":
            sub.add_argument("--out", metavar="DIR", help="run folder (default: runs/<name of the study>)")
            _add_survival(sub)

    _add_sweep(verb)

    sub = verb("report", commands.report, "write report.html of a run folder again; runs nothing")
    sub.add_argument("folder", metavar="RUN_DIR")
    sub.add_argument("--load", action="store_true", help="load an oracle in a file, to draw it: this runs the file")

    sub = verb("status", commands.status, "say where a run or a sweep is, from another terminal; changes nothing")
    sub.add_argument("folder", metavar="DIR", help="run folder, or folder of a sweep")
    sub.add_argument("--watch", action="store_true", help="say it again every two seconds until the run ends")

    _add_tables(verb)

    _add_exports(verb)
    verb("list", commands.list_known, "list oracles, designs and export targets with their settings")
    return parser


def _add_sweep(verb: Callable[[str, object, str], argparse.ArgumentParser]) -> None:
    """The command of studies of studies."""
    sub = verb("sweep", commands.sweep, "run a study for every member of a grid, or continue it, and compare them")
    sub.add_argument("config", metavar="CONFIG", help="config file, TOML; its table [sweep] is the grid, or a part")
    sub.add_argument("--over", action="append", default=[], metavar="KEY=A,B,C", dest="over",
                     help="values of a setting, such as oracle.parameters.thickness=1e-3,2e-3; several make the full "
                     "grid; ranges=0.5,1,2 scales the ranges of all factors; repeatable")  # fmt: skip
    sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
                     help="replace a setting in all members; repeatable")  # fmt: skip
    sub.add_argument("--out", metavar="DIR", help="folder of the run folders (default: runs/<name of the study>-sweep)")
    sub.add_argument("--dry-run", action="store_true", help="check every member and print the grid; touches nothing")
    _add_survival(sub)


def _add_survival(sub: argparse.ArgumentParser) -> None:
    """How ``run`` treats what was answered before."""
    sub.add_argument("--fresh", action="store_true", help="start anew in a folder that was used before")
    sub.add_argument("--cache", metavar="DIR", help="folder of points that studies share: none is paid for twice")
    kinds = [str(status) for status in FAILURES]
    sub.add_argument("--retry-failed", action="store_true", help="run again every point that failed before")
    sub.add_argument("--retry", action="append", default=[], choices=kinds, metavar="KIND",
                     help=f"run again the points that failed so: {', '.join(kinds)}; repeatable")  # fmt: skip


def _add_exports(verb: Callable[[str, object, str], argparse.ArgumentParser]) -> None:
    """The commands of generated code: ``export`` and ``verify``."""
    sub = verb("export", commands.export, "generate code from a model and verify it; without a model, list the targets")
    sub.add_argument("model", metavar="MODEL.json", nargs="?")
    sub.add_argument("--to", metavar="NAME", help="target, or several with commas between them, or all")
    sub.add_argument("--out", metavar="DIR", help="folder to write to; of several targets, each in a folder of its own")
    sub.add_argument("--prefix", metavar="NAME", help="prefix of generated names (default: name of the study)")
    sub.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", dest="overrides",
                     help="a setting of the target, such as max_iterations=20; repeatable")  # fmt: skip
    sub.add_argument("--force", action="store_true", help="overwrite files that are there already")
    sub.add_argument("--no-verify", action="store_false", dest="verify", help="only write")

    sub = verb("verify", commands.verify, "verify generated code again: unchanged, from its model, the same numbers")
    sub.add_argument("folder", metavar="FOLDER", help="folder of an export, of several, or of a run")


def _add_tables(verb: Callable[[str, object, str], argparse.ArgumentParser]) -> None:
    """The commands that answer a table: ``predict`` and ``invert``."""
    for name, function, table, summary in (
        ("predict", commands.predict, "IN.csv", "responses at settings from a CSV"),
        ("invert", commands.invert, "TARGETS.csv", "settings for responses from a CSV"),
    ):
        sub = verb(name, function, summary)
        sub.add_argument("model", metavar="MODEL.json")
        sub.add_argument("table", metavar=table, help="CSV with one named column each; '-' reads standard input")
        sub.add_argument("--out", metavar="FILE", help="write the answers there instead of printing them")
        if name == "invert":
            sub.add_argument("--all", action="store_true",
                             help="all settings in the domain that give a target, a row each")  # fmt: skip
        if name == "predict":
            sub.add_argument("--outside", choices=("flag", "refuse"), default="flag",
                             help="settings outside the domain: answer and mark them, or refuse")  # fmt: skip
            sub.add_argument("--interval", type=float, metavar="LEVEL",
                             help="add the ends of prediction intervals of this level: 0.9, 0.95 or 0.99")  # fmt: skip
