"""Edits of several calls, or several arguments, that are one step of the history."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress

from controller.studio.source import Source
from controller.studio.syntax import Site, lost_comments
from go2_wbc.errors import StudioError

MOST = 1000  #: Calls that one order may concern

Edit = Callable[[Source, Mapping[str, object]], Source]  #: See ``edits.edited``


def copied(source: Source, order: Mapping[str, object]) -> tuple[str, ...]:
    """The texts of the calls that end in ``sites``, in the order of the file."""
    return tuple(source.text(site) for site in sorted(_sites(order)))


def pasted(source: Source, order: Mapping[str, object], texts: Sequence[str]) -> Source:
    """With copies of calls behind the one that ends in ``site``.

    Raises:
        StudioError: if nothing was copied, or no call ends there.
    """
    if not texts:
        raise StudioError("nothing was copied")
    (site,) = _sites({"sites": [order.get("site")]})
    for text in texts:
        source = source.insert(site, text)
        site = source.site or site
    return source


def edited_together(source: Source, order: Mapping[str, object], edit: Edit) -> Source:
    """The text after one edit, or several.

    Args:
        source: the text that is saved.
        order: as ``edit`` takes it; or with ``op`` "set_many" and ``values``, several arguments
            of one call; "many" and ``orders``, each with its own site in the saved text; "copies"
            and ``sites``, copies of these calls behind ``site``; "move" and ``sites``, they
            themselves behind ``site``, or before it if ``is_ahead``. Neighbours in one chain are
            exchanged, with their comments: ``step`` is -1 or 1.
        edit: makes one edit.

    Raises:
        StudioError: if one of them cannot be made; none is then.
    """
    op = order.get("op")
    if op == "copies":
        return pasted(source, order, copied(source, order))
    if op == "set_many":
        return _set_many(source, order, edit)
    if op == "move":
        return _moved(source, order, edit)
    if op != "many":
        return edit(source, order)
    orders = order.get("orders")
    if not (isinstance(orders, list) and all(isinstance(one, dict) for one in orders)):
        raise StudioError("several edits need a list of them")
    sites = _sites({"sites": [one.get("site") for one in orders]})
    for _, one in sorted(zip(sites, orders, strict=True), key=lambda pair: pair[0], reverse=True):
        source = edited_together(source, one, edit)  # from the end: the places before stay
    return source


def _moved(source: Source, order: Mapping[str, object], edit: Edit) -> Source:
    sites, (target,) = sorted(_sites(order)), _sites({"sites": [order.get("site")]})
    if len(sites) == 1 and order.get("step") in (-1, 1):
        with suppress(StudioError):
            return edit(source, {**order, "op": "swap", "site": list(sites[0])})
    texts, lost = copied(source, order), list[str]()
    end = source.offset(target)
    for site, text in zip(reversed(sites), reversed(texts), strict=True):
        after = source.delete(site)
        lost.insert(0, lost_comments(source.data, after.data + text.encode()))
        if site < target:
            end -= len(source.data) - len(after.data)
        source = after
    target = source.syntax.site(end)
    for text, comment in zip(texts, lost, strict=True):
        source = source.insert(target, text).noted(comment)
        target = source.site or target
    if order.get("is_ahead") is True:
        if len(texts) > 1:
            raise StudioError("one at a time before the first move of all")
        source = source.swap(source.site or target, -1)
    return source


def _set_many(source: Source, order: Mapping[str, object], edit: Edit) -> Source:
    values = order.get("values")
    if not (isinstance(values, dict) and values):
        raise StudioError("several arguments need their values by their names")
    for name, value in values.items():
        one = {**order, "op": "set", "name": name, "value": value}
        source = edit(source, one)
        order = {**order, "site": list(source.site or ())}
    return source


def _sites(order: Mapping[str, object]) -> list[Site]:
    given = order.get("sites")
    if not (isinstance(given, list) and 0 < len(given) <= MOST and all(map(_is_site, given))):
        raise StudioError(f"an edit needs the places of calls, got {given!r:.80}")
    return [(site[0], site[1]) for site in given]


def _is_site(given: object) -> bool:
    return isinstance(given, list) and len(given) == 2 and all(type(n) is int for n in given)
