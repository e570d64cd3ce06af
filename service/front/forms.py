"""Forms of the pages: declared as values, sent by a script as JSON or files to the operations that programs call.

An operation stands once, under /v1; the script says an error of it in words beside the field that it is about.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import Any, Literal

from pydantic import TypeAdapter

from slipstick.pictures.theme import in_words
from slipstick.report.markup import coded, paragraph

from ..front.elements import options

Kind = Literal["text", "number", "integer", "numbers", "choice", "choices", "flag", "file", "hidden"]
Place = Literal["body", "query", "header"]
NAME_PATTERN = "[A-Za-z0-9][A-Za-z0-9_\\-]{0,63}"
NAME_RULE = "Up to 64 letters, digits, - and _, starting with a letter or digit"
KEY_PATTERN = "[A-Za-z0-9][A-Za-z0-9._\\-]{0,63}"
"""Names of files, and ids of jobs, in the syntax that browsers compile with the flag v."""
WITHOUT_SCRIPT = ('<noscript><p class="note">The buttons of this page need JavaScript. Without it, <a href="/docs">the '
                  "API page</a> lists the same operations for curl.</p></noscript>")


@dataclass(frozen=True)
class Field:
    """A field: `name` is its key in the body, with dots for objects, or that of a query parameter or header."""

    name: str
    label: str
    about: str = ""
    kind: Kind = "text"
    value: str = ""
    choices: Sequence[tuple[str, str]] = ()
    """Value and text of each choice."""
    is_json: bool = False
    """Whether the values of the choices are JSON, such as numbers, instead of text."""
    place: Place = "body"
    required: bool = False
    pattern: str = ""
    rule: str = ""
    """What the pattern demands, in words."""
    accept: str = ""
    """Extensions of files, several of which may be chosen where `several` is set."""
    several: bool = False

    @property
    def _sends(self) -> str:
        """What the script makes of the value."""
        return {"number": "number", "integer": "number", "choices": "list", "flag": "json", "file": "file",
                "numbers": "numbers"}.get(
            self.kind, "json" if self.is_json else "text")

    def html(self, form: str) -> str:
        """Return the field of the form with the id `form` as HTML."""
        id = f"{form}-{self.name.replace('.', '-')}"
        about = f'<span class="about" id="{id}-about">{coded(self.about)}</span>' if self.about else ""
        data = f'data-sends="{self._sends}" data-place="{self.place}"'
        described = f'aria-describedby="{f"{id}-about " if self.about else ""}{id}-wrong"'
        wrong = f'<span class="wrong" id="{id}-wrong" hidden></span>'
        name, label = escape(self.name), escape(self.label)
        if self.kind == "hidden":
            return f'<input type="hidden" name="{name}" value="{escape(self.value)}" {data}>'
        if self.kind == "flag":
            checked = " checked" if self.value == "true" else ""
            return (f'<div class="field flag"><label><input type="checkbox" id="{id}" name="{name}" value="true" '
                    f'{data} {described}{checked}> {label}</label>{about}{wrong}</div>')
        if self.kind == "choices":
            boxes = "".join(f'<label><input type="checkbox" name="{name}" value="{escape(value)}" {data}> '
                            f"{escape(text)}</label>" for value, text in self.choices)
            return (f'<fieldset class="field" id="{id}" {described}><legend>{label}</legend><div class="boxes">{boxes}'
                    f"</div>{about}{wrong}</fieldset>")
        needs = " required" if self.required else ""
        if self.kind == "choice":
            control = (f'<select id="{id}" name="{name}" {data} {described}{needs}>'
                       f"{options(self.choices, self.value)}</select>")
        elif self.kind == "file":
            control = (f'<input type="file" id="{id}" name="{name}" accept="{escape(self.accept)}" {data} {described}'
                       f"{needs}{' multiple' * self.several}>")
        else:
            rule = f' pattern="{escape(self.pattern)}" title="{escape(self.rule)}"' if self.pattern else ""
            mode = {"number": ' inputmode="decimal"', "integer": ' inputmode="numeric"'}.get(self.kind, "")
            control = (f'<input type="text" id="{id}" name="{name}" value="{escape(self.value)}" autocomplete="off" '
                       f'spellcheck="false" {data} {described}{needs}{rule}{mode}>')
        return f'<div class="field"><label for="{id}">{label}</label>{control}{about}{wrong}</div>'


@dataclass(frozen=True)
class Form:
    """A form that the script sends by `method` to `action`, an operation of /v1.

    `body` says what it sends: the fields as JSON, the file alone, or nothing; "other" leaves it to a script of the
    page. Afterwards the page at `then` is opened: "made" stands for that of what was made, "" for the same page anew.
    """

    id: str
    action: str
    button: str
    fields: Sequence[Field] = ()
    experts: Sequence[Field] = ()
    """Fields that are folded."""
    method: Literal["POST", "PATCH", "DELETE"] = "POST"
    body: Literal["json", "file", "none", "other"] = "json"
    then: str = "made"
    about: str = ""
    hint: str = ""
    """What is said behind the words of the service where it refuses the content."""
    is_dangerous: bool = False

    def html(self) -> str:
        """Return the form as HTML. Its button works once the script runs."""
        hidden = "".join(each.html(self.id) for each in self.fields if each.kind == "hidden")
        shown = "\n".join(each.html(self.id) for each in self.fields if each.kind != "hidden")
        folded = "\n".join(each.html(self.id) for each in self.experts)
        return "\n".join([
            f'<form class="act" id="{self.id}" action="{escape(self.action)}" method="post" '
            f'data-method="{self.method}" data-body="{self.body}" data-then="{escape(self.then)}" '
            f'data-hint="{escape(self.hint)}" novalidate>{hidden}',
            paragraph(self.about, "about") if self.about else "",
            f'<div class="fields">{shown}</div>' if shown else "",
            f'<details class="experts"><summary>Settings for experts</summary><div class="fields">{folded}</div>'
            "</details>" if folded else "",
            f'<p class="send"><button{" class=danger" * self.is_dangerous} disabled>{escape(self.button)}</button>'
            '<span class="busy" role="status"></span></p><p class="wrong" role="alert" hidden></p></form>'])


def folded(title: str, *parts: str) -> str:
    """Return parts below a heading that unfolds them, as a link to a part does."""
    return f'<details class="task"><summary>{escape(title)}</summary>\n' + "\n".join(parts) + "\n</details>"


def expert_fields(model: Any, prefix: str) -> list[Field]:
    """Return a field for each number, choice and flag of a model of settings, with its description and default.

    Settings that are lists or objects are left to programs.
    """
    schema = TypeAdapter(model).json_schema()
    return [made for name, property in schema["properties"].items()
            if (made := _field_of(f"{prefix}.{name}", property, schema.get("$defs", {}))) is not None]


def _field_of(name: str, property: dict[str, Any], definitions: dict[str, Any]) -> Field | None:
    alternatives = [definitions[each["$ref"].rpartition("/")[2]] if "$ref" in each else each
                    for each in property.get("anyOf", [property])]
    shape: dict[str, Any] = next((each for each in alternatives if each.get("type") != "null"), {})
    default = property.get("default")
    made = Field(name, in_words(name.rpartition(".")[2]).capitalize(), property.get("description", ""),
                 value="" if default is None else str(default))
    match shape:
        case {"enum": values}:
            blank = [("", "default")] if default is None else []
            return replace(made, kind="choice", choices=[*blank, *((value, value) for value in values)])
        case {"type": "boolean"}:
            blank = [("", "default")] if default is None else []
            return replace(made, kind="choice", choices=[*blank, ("true", "yes"), ("false", "no")],
                           value=made.value.lower(), is_json=True)
        case {"type": "integer"}:
            return replace(made, kind="integer")
        case {"type": "number"}:
            return replace(made, kind="number")
    return None
