"""The reference, written from the code: public names, the command line, the keys of studies, the
paper's known errata.
"""

import enum
import inspect
import re
import tomllib
from importlib.resources import files
from pathlib import Path

import typer
from public_names import ROOMS, public_names
from sphinx.ext import autosummary

import saltus
from saltus.cli.app import app
from saltus.config.study import QUESTIONS, functions_of, keys_of
from saltus.number_ranges import BESIDE, ranges_of
from saltus.systems import IMPACTS, MODELS, PULSES

FOLDER = Path(__file__).parents[1] / "reference" / "api"


def setup(application):
    """Called by Sphinx."""
    # after which the first sentence of a docstring goes on
    autosummary.WELL_KNOWN_ABBREVIATIONS += ("Fig.", "Figs.")
    application.connect("builder-inited", write_all)
    # before napoleon
    application.connect("autodoc-process-docstring", plain_text_as_rst, priority=400)
    application.connect("missing-reference", where_it_is_public)
    return {"parallel_read_safe": True}


def write_all(_):
    """Write every page that comes from the code; one that has not changed keeps its time, and is
    not read again.
    """
    FOLDER.mkdir(parents=True, exist_ok=True)
    pages = {f"{room}.rst": room_page(room, names) for room, names in public_names().items()}
    pages |= {
        "command_line.md": command_line(),
        "study_keys.md": study_keys(),
        "known_errata.md": known_errata(),
    }
    for name, text in pages.items():
        path = FOLDER / name
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


# --- names -------------------------------------------------------------------


# What one calls first; after these come functions, then what they give, then lists of words.
FIRST = (
    *(
        "System",
        "Load",
        "Harmonic",
        "Record",
        "Metainterface",
        "RockingBlock",
        "PhysicalBlock",
        "WallOscillator",
        "TwoStops",
        "ImpactPair",
    ),
    *("VelocityReduction", "NewtonImpact", "PoissonImpact", "InelasticImpact", "EnergyRestitution"),
    *("OneContactModel", "ContactModel", "Contact", "Friction", "Model"),
    *("simulate", "simulate_many", "sensitivities", "stop_names", "Motion"),
    *(
        "find_orbit",
        "continue_orbit",
        "switch_branch",
        "continue_special",
        "search_orbits",
        "PeriodicOrbit",
        "Branch",
    ),
    *("classify", "find_attractors", "basins_of_attraction", "lyapunov_spectrum"),
    *(
        "response_spectrum",
        "bifurcation_diagram",
        "stability_chart",
        "frequency_sweep",
        "phase_portrait",
    ),
    *("run", "status", "open_store", "Plan", "Variable"),
)


def order_of(name):
    """By which names of a room are sorted; those that are equal keep their order."""
    own, found = name.rpartition(".")[2], _found(name)
    first = FIRST.index(own) if own in FIRST else len(FIRST)
    return first, inspect.isclass(found) and issubclass(found, enum.Enum), inspect.isclass(found)


def room_page(room, names):
    """The names of a room: a table of them, then each with signature, types and example."""
    names = sorted(names, key=order_of)
    lines = [ROOMS[room], "=" * len(ROOMS[room]), "", ".. autosummary::", "   :nosignatures:", ""]
    lines += [f"   ~{name}" for name in names]
    for name in names:
        found = _found(name)
        if inspect.isclass(found):
            lines += ["", f".. autoclass:: {name}", "   :members:"]
            if issubclass(found, enum.Enum):
                lines += ["   :undoc-members:"]
            if issubclass(found, (tuple, str)) or issubclass(found, Exception):
                lines += ["   :exclude-members: count, index, with_traceback, add_note"]
        else:
            lines += ["", f".. autofunction:: {name}"]
    return "\n".join(lines) + "\n"


def _found(name):
    """The object with this full name."""
    if name.count(".") == 1:
        return getattr(saltus, name.removeprefix("saltus."))
    room, own = name.removeprefix("saltus.").split(".")
    return getattr(getattr(saltus, room, None) or __import__(f"saltus.{room}", fromlist=["_"]), own)


def plain_text_as_rst(_app, _what, _name, _found, _options, lines):
    """Docstrings are plain text: an indented paragraph after an empty line is an equation, stars
    and bars are what they are.
    """
    if _what == "attribute" and lines and ":" in lines[0]:
        lines[0] = f":{lines[0]}"  # napoleon would take the words before the colon for a type
    # by how much the text before an equation is indented, and one
    given, example, equation = list(lines), False, 0
    lines.clear()
    for number, line in enumerate(given):
        indent = len(line) - len(line.lstrip())
        if line.strip() and indent < equation:
            equation = 0
        example = line.strip() and (example or line.lstrip().startswith(">>>"))
        if equation or example:
            lines.append(line)
            continue
        lines.append("".join(_escaped(part) for part in re.split(r"(`[^`]*`(?:\w)?)", line)))
        if _next_is_deeper(given, number, indent):
            equation = indent + 1
            lines[-1:] = (
                [lines[-1] + ":"]
                if line.rstrip().endswith(":")
                else [lines[-1], "", " " * indent + "::"]
            )


def where_it_is_public(_app, env, node, content):
    """Types in signatures are named by the file that defines them: link the name that users import,
    if there is one.
    """
    target = node.get("reftarget", "")
    known = {name.rpartition(".")[2]: name for names in public_names().values() for name in names}
    if node.get("refdomain") != "py" or not target.startswith("saltus."):
        return None
    public = known.get(target.rpartition(".")[2])
    if public is None:
        return content  # of an inner file, for which there is no page
    return env.get_domain("py").resolve_xref(
        env, node["refdoc"], _app.builder, "obj", public, node, content
    )


def _next_is_deeper(lines, number, indent):
    """Whether an empty line and then a deeper one follow a line of text."""
    after = lines[number + 1 : number + 3]
    deeper = (
        len(after) == 2 and not after[0].strip() and len(after[1]) - len(after[1].lstrip()) > indent
    )
    return bool(deeper and lines[number].strip() and not after[1].lstrip().startswith(">>>"))


def _escaped(part):
    if part.startswith("`"):
        return part if part.endswith("`") else f"{part[:-1]}\\ {part[-1]}"  # `DataArray`s
    text = re.sub(r"(?<=.)\*|^\*(?! )|\|", lambda found: "\\" + found[0], part)
    return re.sub(r"(\w)_(?=\W|$)", r"\1\\_", text)


# --- command line ------------------------------------------------------------


def command_line():
    """The commands with their arguments and options, as `saltus COMMAND --help` has them."""
    lines = [
        "# The command line",
        "",
        "Every command has `--help`. Its exit status is 0, or 2 after a refusal (one sentence",
    ]
    lines += ["says why), or 130 after Ctrl-C.", ""]
    for name, command in typer.main.get_command(app).commands.items():
        arguments = " ".join(
            p.metavar or p.name.upper() for p in command.params if not _is_option(p)
        )
        lines += [
            f"## `saltus {name}`",
            "",
            f"```text\nsaltus {name} [OPTIONS] {arguments}\n```",
            "",
            _plain(command.help),
            "",
        ]
        lines += ["| argument or option | |", "|---|---|"]
        for p in command.params:
            labels = [*p.opts, *p.secondary_opts] if _is_option(p) else [p.metavar]
            text = _plain(getattr(p, "help", None) or "").replace("|", "/")
            lines.append(f"| {', '.join(f'`{label}`' for label in labels)} | {text} |")
        lines.append("")
    return "\n".join(lines)


def _is_option(parameter):
    return parameter.opts[0].startswith("-")


def _plain(text):
    """Rich's marks as Markdown."""
    text = re.sub(r"\[cyan\](.*?)\[/\]", r"`\1`", text or "")
    return re.sub(r"\\\[(\w+)\]", r"`[\1]`", text)


# --- studies -----------------------------------------------------------------


def study_keys():
    """All tables of a study, with every key and the default that the code gives it."""
    lines = [
        "# All keys of a study",
        "",
        "What each means is on the page [A study in a file](../../study.md).",
    ]
    lines += ["A key without a default must be given, or is one of several that may be.", ""]
    lines += ["## `[model]`", "", "| type | key | default | range |", "|---|---|---|---|"]
    lines += [
        row
        for name, cls in sorted(MODELS.items())
        if cls.__module__.startswith("saltus.")
        for row in _fields(name, cls)
    ]
    lines += ["", "## `[impact]`", "", "| type | key | default | range |", "|---|---|---|---|"]
    lines += [row for name, cls in sorted(IMPACTS.items()) for row in _fields(name, cls)]
    lines += ["", "## A signal in `[load]`", ""]
    lines += ["| type | key | default | range |", "|---|---|---|---|"]
    signals = {"a harmonic": saltus.Harmonic, "a record": saltus.Record, **PULSES}
    lines += [row for name, cls in signals.items() for row in _fields(name, cls)]
    for kind in QUESTIONS:
        defaults = {
            k: v.default
            for function in functions_of(kind)
            for k, v in inspect.signature(function).parameters.items()
        }
        lines += ["", f"## `[{kind}]`", "", "| key | default |", "|---|---|"]
        lines += [
            f"| `{key}` | {_default(defaults.get(key, inspect.Parameter.empty))} |"
            for key in sorted(keys_of(kind))
        ]
    return "\n".join(lines) + "\n"


def _fields(name, cls):
    parameters = inspect.signature(cls).parameters.values()
    ranges = ranges_of(cls)
    return [
        f"| `{name}` | `{p.name}` | {_default(p.default)} | {_range(ranges.get(p.name))} |"
        for p in parameters
    ] or [f"| `{name}` | | | |"]


def _range(declared):
    """The declared range of a number in words."""
    if declared is None:
        return ""
    beside = [f"{BESIDE[side].partition(' ')[2]} `{other}`" for side, other in declared.beside]
    whole = ["whole"] if declared.whole else []
    words = ", ".join([*whole, *([declared.text] if declared.text else []), *beside])
    return f"{words} {declared.unit}".strip()


def _default(value):
    return "" if value is inspect.Parameter.empty or "object at" in repr(value) else f"`{value!r}`"


# --- errata ------------------------------------------------------------------


def known_errata():
    """The errata 1 to 28 of the paper that were known; what follows was found while building saltus
    (docs/errata.md).
    """
    known = tomllib.loads((files("saltus_paper") / "errata.toml").read_text(encoding="utf-8"))
    lines = [
        "# The known errata of the paper, 1 to 28",
        "",
        "What is right, and why. Each is proved again by a test that is",
    ]
    lines += ["called after it. From 29 on they are our own: [disagreements](../../errata.md).", ""]
    for number, erratum in known.items():
        if int(number) <= 28:
            keys = ("place", "correct", "derivation")
            place, correct, derivation = (
                re.sub(r"([*|])", r"\\\1", erratum[key]).replace("\n", " ") for key in keys
            )
            lines += [f"## {number}. {place}", "", correct, "", f"*Derivation.* {derivation}", ""]
    return "\n".join(lines)
