"""What a page may ask for: edits as data. Code never comes from there; calls are written here."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from controller.studio.library import used
from controller.studio.literals import Run
from controller.studio.orders import Cut
from controller.studio.rewriting import begun, parametrised, unrolled
from controller.studio.source import Source, first_parameters, parameters, written
from controller.studio.syntax import Site
from go2_wbc.errors import StudioError, unknown_name


@dataclass(frozen=True, slots=True)
class Template:
    """A call that can be put into a motion."""

    title: str  #: on the page
    call: str  #: name of the method
    arguments: Mapping[str, float | str]  #: what it is called with at first
    is_put_down: bool = False  #: whether the foot of it is put down after

    def code(self, source: Source) -> str:
        """It as text of this file."""
        first, given = first_parameters(self.call), self.arguments.items()
        texts = [
            source.value(name, value) if name in first else source.argument(name, value)
            for name, value in given
        ]
        end = ""
        if self.is_put_down:
            end = Template("", "down", {"leg": self.arguments["leg"], "over": 0.5}).code(source)
        return f".{self.call}({', '.join(texts)}){end}"


REST = 0.1
"""Time [s] that a foot stands before it is raised again: raised at once, it touches the ground with
a newton or less, and one of five such touches is missed."""
MOST_CALLERS = 20  #: Helpers that call each other
PALETTE: Mapping[str, Template] = MappingProxyType(
    {
        template.title: template
        for template in (
            Template("Move the trunk", "body", {"z": -0.03, "over": 0.6}),
            Template("Tilt the trunk", "body", {"pitch": 10.0, "over": 0.6}),
            Template("Turn the trunk", "body", {"yaw": 10.0, "over": 0.6}),
            Template("Take a pose", "pose", {"name": "bow", "over": 0.8}),
            Template("Look at a place", "look_at", {"x": 1.0, "y": 0.3, "z": 0.4, "over": 0.6}),
            Template("Pause", "hold", {"seconds": 0.5}),
            Template("Raise a foot", "foot", {"leg": "FR", "z": 0.08, "over": 0.5}),
            Template(
                "Lift and put down", "foot", {"leg": "FR", "z": 0.08, "over": 0.5}, is_put_down=True
            ),
            Template("Put a foot down", "down", {"leg": "FR", "over": 0.5}),
            Template("All home", "home", {"over": 0.8}),
            Template("Step with a foot", "step", {"leg": "FR", "x": 0.05, "over": 0.5}),
            Template("Walk", "walk", {"x": 0.2}),
            Template("Turn round", "turn", {"angle": 20.0}),
            Template("Jump", "jump", {"height": 0.1}),
        )
    }
)
"""The calls that a page offers, by their titles."""


def edited(source: Source, order: Mapping[str, object], motion: str = "") -> Source:
    """The text after one edit.

    Args:
        source: the text that is saved.
        order: ``op``, ``site`` of the call, and what the edit needs: ``name``, ``value`` and the
            ``number`` of the run, ``title`` of a template and the ``values`` of its arguments that
            differ, or ``step``. ``op`` is one of

            - "set", "insert", "swap", "delete", "duplicate": of a call;
            - "unroll": the innermost loop around it is written out;
            - "parameter": the number of the argument ``name`` becomes one of the motion;
            - "pace": ``.scale_time(value)`` is added to the motion;
            - "library": the motion of the library with this ``name`` is played behind the call, or
              as the first one where no ``site`` is given;
            - "last": the call of ``title`` is put at the end of the motion;
            - "begin": the call of ``title`` is put behind a ``Timeline()`` that has none.

            ``callers``: of the bar, if it is not the only one that runs in a helper.
        motion: the name of the motion that is shown.

    Raises:
        StudioError: for an order that is not one, or an edit that cannot be made.
    """
    op, site = order.get("op"), order.get("site")
    if op == "pace":
        return source.append(motion, f".scale_time({written(_number(order))})")
    if op == "last":
        return source.append(motion, _template(order).code(source))
    if op == "begin":
        return begun(source, motion, _template(order).code(source))
    if op == "library":
        return used(source, motion, None if site is None else site_of(site), order.get("name"))
    if op == "parameter":
        name = str(order.get("name"))
        return parametrised(source, motion, site_of(site), name, run_of(order))
    if not isinstance(op, str) or op not in _EDITS:
        raise StudioError(
            unknown_name(
                "edit", str(op), [*_EDITS, "parameter", "pace", "library", "last", "begin"]
            )
        )
    return _EDITS[op](source, site_of(site), order)


def site_of(site: object) -> Site:
    """The place of a call, as a page tells it; raises StudioError if it is none."""
    if not (isinstance(site, list) and len(site) == 2 and all(type(n) is int for n in site)):
        raise StudioError(f"an edit needs the place of a call, got {site!r:.80}")
    return site[0], site[1]


def run_of(order: Mapping[str, object]) -> Run:
    """Which run of its call an order means; raises StudioError if it says that in no valid way."""
    number, callers = order.get("number"), order.get("callers") or []
    number = number if type(number) is int else 0
    if not (isinstance(callers, list | tuple) and len(callers) <= MOST_CALLERS):
        raise StudioError(f"callers are places of calls, got {callers!r:.80}")
    known = list[tuple[Site, int]]()
    for caller in callers:
        match caller:
            case [[int(line), int(column)], int(times)]:
                known.append(((line, column), times))
            case _:
                raise StudioError(f"a caller is a place and a number, got {caller!r:.80}")
    return Run(number, tuple(known))


def cut_of(order: Mapping[str, object]) -> Cut:
    """Where an order splits a call; raises StudioError if it says that in no valid way."""
    time, number = order.get("time"), order.get("number") or 0
    if not isinstance(time, int | float) or type(number) is not int:
        raise StudioError(f"a call is split at a time, got {time!r:.40}")
    return Cut(site_of(order.get("site")), number, float(time))


def _number(order: Mapping[str, object]) -> float:
    value = order.get("value")
    if not isinstance(value, int | float) or isinstance(value, bool):
        raise StudioError(f"{order.get('op')} needs a number, got {value!r:.40}")
    return float(value)


def _set(source: Source, site: Site, order: Mapping[str, object]) -> Source:
    name, value = order.get("name"), order.get("value")
    is_value = isinstance(value, int | float | str) and not isinstance(value, bool)
    if not isinstance(name, str) or not is_value:
        raise StudioError(f"an argument needs a number or a word, got {name!r:.40} {value!r:.40}")
    return source.set(site, name, value, run_of(order))  # pyright: ignore[reportArgumentType]


def _insert(source: Source, site: Site, order: Mapping[str, object]) -> Source:
    template = _template(order)
    leg, given = template.arguments.get("leg"), source.slots(site)
    is_down = source.text(site).startswith(".down(") and any(slot.value == leg for slot in given)
    rest = f".hold({REST})" if template.call == "foot" and is_down else ""
    return source.insert(site, rest + template.code(source))


def _template(order: Mapping[str, object]) -> Template:
    title = order.get("title")
    if not isinstance(title, str) or title not in PALETTE:
        raise StudioError(unknown_name("move", str(title), PALETTE))
    values, template = order.get("values") or {}, PALETTE[title]
    if not isinstance(values, dict) or not set(values) <= set(parameters(template.call)):
        raise StudioError(f"{template.call}() takes {', '.join(parameters(template.call))}")
    if not all(type(value) in (int, float, str) for value in values.values()):
        raise StudioError("an argument needs a number or a word")
    return replace(template, arguments={**template.arguments, **values})


_EDITS: Mapping[str, Callable[[Source, Site, Mapping[str, object]], Source]] = {
    "set": _set,
    "insert": _insert,
    "swap": lambda source, site, order: source.swap(site, -1 if order.get("step") == -1 else 1),
    "delete": lambda source, site, _: source.delete(site),
    "unroll": lambda source, site, order: unrolled(source, site, run_of(order)),
    "duplicate": lambda source, site, _: source.duplicate(site),
}
