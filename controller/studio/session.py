"""A studio that is open: the file, what runs it, and the page."""

from __future__ import annotations

import logging
import secrets
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import final

from controller.studio import bars, certifying, exports, songs, worlds
from controller.studio.edits import cut_of, edited, run_of, site_of
from controller.studio.grounds import PlayedGround, ground_of
from controller.studio.library import library
from controller.studio.orders import AT_ONCE, Answer, Bar, Cut, Doing, Order, Task
from controller.studio.plain import NO_WAY, refusal
from controller.studio.project import Project
from controller.studio.proposals import proposal, read
from controller.studio.rewriting import offers
from controller.studio.running import Runner
from controller.studio.searching import most
from controller.studio.shows import with_show
from controller.studio.source import Source
from controller.studio.together import copied, edited_together, pasted
from go2_wbc.errors import Go2WbcError, StudioError, unknown_name
from go2_wbc.world import World
from motions.authoring import Value
from viz.content import CertifiedRate, ReplayContent
from viz.replay.page_data import Prepared
from viz.replay.preview_server import PreviewServer

_log = logging.getLogger(__name__)

HISTORY = ("undo", "redo")
LONGEST_SOLVE, LONGEST_TRY = 6.0, 3.0
"""Processor time [s] that a jump which the page asks for is solved for, and one of those that are
tried for the most that can be done: own choice. Of 17 jumps that the robot can do the slowest took
2.3 s; none that took longer than 5 s passed the check."""
LONGEST_NEAREST = 20.0  #: The same of the nearest motion: what the solver gives one part of it


@final
class Studio:
    """A context manager: serves the page of one motion, and edits its file as the page asks.

    Attributes:
        url: of the page, with the token that the page sends back.
        motion: the name of the motion.
    """

    def __init__(self, path: Path, motion: str | None, port: int) -> None:
        """Run the file and serve its page.

        Args:
            path: of the file.
            motion: which of its motions; the first one by default.
            port: 0 for any that is free.

        Raises:
            StudioError: if the file cannot be read, or is no motion.
            ConfigError: if the port cannot be used.
        """
        self._project, self._values = Project(path), dict[str, Value]()
        self._lock, self.motion = threading.RLock(), motion
        self._doing, self._world, self._ground = dict[str, Doing](), World(), PlayedGround()
        self._runner, self._player = Runner(), Runner()
        self._is_solved = self._is_looking = True  # all that jumps in what is saved; for what does
        self._is_away = False  # the file, when it was looked at last
        self._changes = self._copied = self._motions = tuple[str, ...]()
        self._proposed: tuple[bytes, bytes] | None = None  # what was saved, and the nearest to it
        self._searches = set[threading.Event]()  # of what goes on; an edit ends it by its event
        self._rates = dict[tuple[object, ...], CertifiedRate]()  # of ``_counted``
        self._bars: tuple[Bar, ...] = ()
        try:
            shown = self._run(self._project.saved, Task.EXPORT, longest=AT_ONCE)
            self.motion, self._is_looking = shown.title, not shown.is_solved
            token = secrets.token_urlsafe(16)
            self._server = PreviewServer(
                exports.whole(self._content(shown)),
                shown.title,
                port,
                self._choose,
                token=token,
                actions={
                    "/edit": self.edit,
                    "/copy": self.copy,
                    "/choose": self.choose,
                    "/world": self.meet,
                    "/library": lambda _: library(),
                    "/music": partial(songs.music, self._project.path),
                    "/play": self.play,
                    "/cancel": self.cancel,
                    "/highest": self.highest,
                    "/mend": self.mend,
                    "/nearest": self.nearest,
                    "/beside": self.beside,
                    "/certify": self.certify,
                    "/export": self.export,
                },
            )
        except BaseException:
            self._end()
            raise
        self._runner.tell = partial(self._told_of, "edit")
        self._player.tell = partial(self._told_of, "play")
        self.url = f"{self._server.url}?token={token}"
        self._search = threading.Thread(target=self._look_for_jumps, daemon=True)
        if self._is_looking:
            self._search.start()

    def warm(self) -> None:
        """Load what playing takes, meanwhile: the first time then is as short as the others."""
        threading.Thread(target=self._player.warm, daemon=True).start()

    @property
    def told(self) -> str:
        """What there is to say of the jumps of the file; nothing where all of them are solved."""
        if self._is_looking:
            return f"what it asks for is looked for meanwhile, for {LONGEST_SOLVE:g} s of work"
        return "" if self._is_solved else f"what it asks for: {NO_WAY}"

    def _look_for_jumps(self) -> None:
        """In the process that plays: edits go on; the plans are kept, and found by the other."""
        self._player.warm()  # which it is for once; it takes no longer than a jump
        try:
            self._player.run(self._order(self._project.saved, Task.CHECK, LONGEST_SOLVE))
        except StudioError as error:
            _log.info("no jump is looked for: %s", error)
        with self._lock:
            self._is_looking = False
            self.show(is_afresh=True)

    def edit(self, order: Mapping[str, object]) -> dict[str, object] | bytes:
        """Do what a page asks for.

        Args:
            order: see ``edited_together``; besides ``op`` "undo" and "redo", "saved" (a draft is
                given up), "change" (see ``mend``), "nearest" (see it), "offers" (what there is to
                do for a bar, by ``site`` and ``number``) and "split" (it, at a ``time``), "show" (a
                motion that plays all others), and "paste" behind ``site`` what ``copy`` has taken;
                "write_out" a ``bar``, by its place, "read" the file that it is of. Of an order that
                is ``proposed`` what it would change in the text is told. ``base`` is the state of
                the file that the page knows, ``has`` the version that it shows, ``commit`` to save.

        Returns:
            What the page shows next, see ``PreviewServer.answer``; of what was saved the ``site``
            of the call that was changed or made; or why nothing was done.
        """
        with self._lock:
            try:
                if self._project.refresh():
                    self.show()
                if order.get("op") not in HISTORY and order.get("base") != self._project.base:
                    raise StudioError("the file was saved elsewhere: this is what it says now")
                if order.get("op") == "saved":
                    return {}
                if order.get("op") == "offers":
                    place = site_of(order.get("site")), run_of(self._with_callers(order))
                    source = Source(self._project.saved)
                    return {"offers": offers(source, self.motion or "", *place)}
                if order.get("op") == "read":
                    return read(self._bars[self._bar(order)])
                if isinstance(proposed := order.get("proposed"), dict):
                    after = self._edited(proposed)
                    return proposal(Source(self._project.saved), after, self.motion or "")
                return self._done(order)
            except StudioError as error:
                return {"error": str(error)}

    def _done(self, order: Mapping[str, object]) -> dict[str, object] | bytes:
        if self._searches:
            self._end_searches()
        if (op := order.get("op")) in HISTORY:
            (self._project.undo if op == "undo" else self._project.redo)()
            self.show()
            return {}
        if order.get("op") == "show":
            source, chosen = with_show(Source(self._project.saved), self._motions)
        else:
            source, chosen = self._edited(order), self.motion
        data, site = source.data, dict[str, object](site=source.site)
        is_saved = order.get("commit") is True  # what is no motion is not
        task = Task.CHECK if is_saved else Task.DRAFT
        try:
            shown = self._run(data, task, chosen=chosen, longest=LONGEST_SOLVE)
        except StudioError as error:
            raise StudioError(refusal(str(error), self._project.saved, data)) from error
        if self._is_solved and not shown.is_solved:
            after = f" in {LONGEST_SOLVE:g} s of work" if shown.content is None else ""
            told = f"no way to do it was found{after}; the motion is as it was."
            return {"error": told, "unsolved": True}
        if is_saved:
            self._project.save(data)
            self._bars, self._is_solved, self.motion = shown.bars, shown.is_solved, shown.title
            self._server.publish(self._content(shown), shown.title)
            return site
        editor = {"bars": [bars.draft(bar) for bar in shown.bars]}
        content = replace(shown.shown(), editor=editor)
        return self._server.answer({}, content, shown.title, order.get("has"))

    def _edited(self, order: Mapping[str, object]) -> Source:
        source = Source(self._project.saved)
        if order.get("op") == "paste":
            return pasted(source, order, self._copied)
        if order.get("op") in ("split", "write_out"):
            return self._rewritten(order)
        if order.get("op") == "nearest":
            if self._proposed is None or self._proposed[0] != source.data:
                raise StudioError("that was the nearest to another motion: look for it again")
            return Source(self._proposed[1])
        if order.get("op") != "change":
            motion = self.motion or ""
            return edited_together(
                source, order, lambda text, one: edited(text, self._with_callers(one), motion)
            )
        which = order.get("which")
        if type(which) is not int or not 0 <= which < len(self._changes):
            raise StudioError("a change is one of those that were proposed")
        return source.append(self.motion or "", self._changes[which])

    def _rewritten(self, order: Mapping[str, object]) -> Source:
        """What values there are at an instant, or were once, is known to what runs the file."""
        part = cut_of(order) if order.get("op") == "split" else self._bar(order)
        after = self._run(self._project.saved, Task.REWRITE, part).text
        if after is None:
            raise StudioError("there is nothing to rewrite")
        return Source(*after)

    def _bar(self, order: Mapping[str, object]) -> int:
        bar = order.get("bar")
        if type(bar) is not int or not 0 <= bar < len(self._bars):
            raise StudioError(f"a bar is one of those that are shown, got {bar!r:.40}")
        return bar

    def copy(self, order: Mapping[str, object]) -> dict[str, object]:
        """Keep the calls that end in ``sites``, to be pasted into any motion of the file."""
        with self._lock:
            try:
                self._copied = copied(Source(self._project.saved), order)
            except StudioError as error:
                return {"error": str(error)}
        count = len(self._copied)
        return {"told": f"copied {count} {'moves' if count > 1 else 'move'}"}

    def choose(self, order: Mapping[str, object]) -> dict[str, object]:
        """Show another motion of the file: ``motion`` is its name."""
        with self._lock:
            before, name = self.motion, order.get("motion")
            if not isinstance(name, str) or name not in self._motions:
                return {"error": unknown_name("motion", str(name), self._motions)}
            self.motion, self._values = name, {}
            try:
                shown = self._run(self._project.saved, longest=LONGEST_SOLVE)
                self._server.publish(self._content(shown), name)
            except StudioError as error:
                self.motion = before
                return {"error": str(error)}
        return {}

    def meet(self, order: Mapping[str, object]) -> dict[str, object]:
        """Check and play in another world from now on, on another ground: see ``worlds``."""
        with self._lock:
            before = self._world, self._ground
            try:
                self._world, self._ground = worlds.world_of(order), ground_of(order)
                shown = self._run(self._project.saved, longest=LONGEST_SOLVE)
                self._server.publish(self._content(shown), shown.title)
            except StudioError as error:
                self._world, self._ground = before
                return {"error": str(error)}
        return {}

    def play(self, order: Mapping[str, object]) -> dict[str, object] | bytes:
        """The motion as it is saved, in MuJoCo beside the plan; or why it could not be played."""
        try:
            shown = self._run(self._project.saved, Task.PLAY)
        except StudioError as error:
            return {"error": str(error)}
        told = {"told": shown.told}
        return self._server.answer(told, self._content(shown), shown.title, order.get("has"))

    def cancel(self, _: Mapping[str, object]) -> dict[str, object]:
        """End what is solved or played; its request then is answered with an error."""
        self._end_searches()
        self._runner.stop()
        return {}

    def highest(self, order: Mapping[str, object]) -> dict[str, object]:
        """The most of an argument that can be done, short of what an ``order`` "set" asks for.

        It is looked for between that and what is saved, in the process that plays: edits go on.
        """
        source, known = Source(self._project.saved), self._bars
        full, motion = self._with_callers(order), self.motion or ""
        try:
            return {"highest": most(source, full, known, motion, self._can_do)}
        except (StudioError, ValueError) as error:
            return {"error": str(error)}

    def _can_do(self, data: bytes, index: int) -> bool:
        """Whether the robot can do a call of a text, in as long as is tried."""
        order = self._order(data, Task.CHECK, LONGEST_TRY)
        shown = self._player.run(replace(order, is_shown=False))
        return shown.is_solved and index < len(shown.bars) and not shown.bars[index].broken

    def mend(self, _: Mapping[str, object]) -> dict[str, object]:
        """What would make the motion possible, as it is saved; taken by ``op`` "change"."""
        try:
            found = self._run(self._project.saved, Task.MEND).changes
        except StudioError as error:
            return {"error": str(error)}
        self._changes = tuple(call for call, _ in found)
        return {"changes": found}

    def nearest(self, order: Mapping[str, object]) -> dict[str, object] | bytes:
        """The nearest motion that the robot can do as a ghost of what is saved, or why none is.

        With how far it is, and the "diff" of ``op`` "nearest". The next edit ends the search.
        """
        data = self._project.saved
        try:
            with self._search_ended_by_edits():
                shown = self._run(data, Task.NEAREST, longest=LONGEST_NEAREST)
            if shown.text is None:
                raise StudioError(f"no motion near to yours in {LONGEST_NEAREST:g} s of work")
        except StudioError as error:
            return {"error": str(error)}
        self._proposed = data, shown.text[0]
        told = proposal(Source(data), Source(shown.text[0]), self.motion or "")
        told["told"] = shown.told
        return self._server.answer(told, self._content(shown), shown.title, order.get("has"))

    def beside(self, order: Mapping[str, object]) -> dict[str, object] | bytes:
        """What is saved, beside it what change ``which`` of ``mend`` makes of it."""
        try:
            after = self._edited({"op": "change", "which": order.get("which")}).data
            shown = self._run(self._project.saved, Task.BESIDE, after, longest=LONGEST_SOLVE)
        except StudioError as error:
            return {"error": str(error)}
        return self._server.answer({}, self._content(shown), shown.title, order.get("has"))

    def certify(self, order: Mapping[str, object]) -> dict[str, object]:
        """How often what is saved is done in ``runs`` random worlds around the one that is chosen.

        That is shown beside the verdict; told is a "row" of a table. The next edit ends it.
        """
        base, motion, _, world = counted = self._counted
        tell = partial(self._told_of, "certify")
        try:
            with self._search_ended_by_edits() as ending:
                rate = certifying.certified(self._writer(), order, world, tell, ending)
        except Go2WbcError as error:
            return {"error": str(error)}
        finally:
            tell(None)
        with self._lock:
            self._rates[counted] = rate
            if counted == self._counted:
                self.show()
        return {"row": certifying.row_of(rate, motion, base)}

    @property
    def _counted(self) -> tuple[str, str, str, World]:
        """What a certificate is of: the text, its motion and its parameters, in a world."""
        return self._project.base, self.motion or "", str(self._values), self._world

    @contextmanager
    def _search_ended_by_edits(self) -> Iterator[threading.Event]:
        ending = threading.Event()  # its own: one that begins does not revive another
        self._searches.add(ending)
        try:
            yield ending
        finally:
            self._searches.remove(ending)

    def _end_searches(self) -> None:
        for ending in tuple(self._searches):
            ending.set()
        self._player.stop()

    def export(self, order: Mapping[str, object]) -> dict[str, object]:
        """Write what is saved beside the file: see ``exports.exported``."""

        def content() -> ReplayContent:
            shown = self._run(self._project.saved, Task.EXPORT)
            return replace(exports.whole(self._content(shown)), editor=None)

        file, motion = self._project.path, self.motion or ""
        told, path = exports.exported(file, motion, order, content, self._writer())
        if path is not None:
            self._server.files[path.name] = path
        return told

    def _writer(self) -> Callable[[Path], object]:
        """Writes what is saved now into a file, as its ending says."""
        order = self._order(self._project.saved, Task.WRITE, 0.0)
        return lambda out: self._player.run(replace(order, out=out))

    def look(self) -> bool:
        """Show what somebody else has saved, once it rests; whether anything is new."""
        with self._lock:
            try:
                is_new = self._project.refresh(must_rest=True)
            except StudioError as error:
                self._is_away = True
                self._server.publish_error(str(error))
                return False
            if not is_new and not self._is_away:
                return False
            self._is_away = False
            self.show()
            return True

    def show(self, *, is_afresh: bool = False) -> None:
        """Run what the file says and show it, or why it is no motion.

        ``is_afresh``: with the jumps that were found meanwhile, and no others.
        """
        longest = AT_ONCE if is_afresh else LONGEST_SOLVE
        try:
            shown = self._run(self._project.saved, longest=longest, is_afresh=is_afresh)
            self.motion = shown.title  # another one, if that has gone
            self._server.publish(self._content(shown), shown.title)
        except StudioError as error:
            self._server.publish_error(str(error))

    def __enter__(self) -> Studio:
        return self

    def __exit__(self, *_: object) -> None:
        self._server.close()
        self._end()

    def _end(self) -> None:
        self._runner.close()
        self._player.close()

    def _choose(self, values: dict[str, Value]) -> None:
        with self._lock:
            self._values = values
            self.show()

    def _run(
        self,
        data: bytes,
        task: Task = Task.CHECK,
        part: Cut | int | bytes | None = None,
        chosen: str | None = None,
        longest: float = 0.0,
        *,
        is_afresh: bool = False,
    ) -> Answer:
        order = self._order(data, task, longest, chosen)
        order = replace(order, part=part, is_afresh=is_afresh)
        is_quick = task in (Task.CHECK, Task.DRAFT, Task.EXPORT, Task.REWRITE, Task.BESIDE)
        answer = (self._runner if is_quick else self._player).run(order)
        if data == self._project.saved and answer.bars:
            self._bars, self._is_solved = answer.bars, answer.is_solved
        return answer

    def _order(self, data: bytes, task: Task, longest: float, chosen: str | None = None) -> Order:
        return Order(
            self._project.path,
            data,
            chosen or self.motion,
            self._values,
            task,
            longest=longest,
            is_shown=longest > 0.0 and (data == self._project.saved or not self._is_solved),
            is_looked_for=self._is_looking,
            world=self._world,
            ground=self._ground,
        )

    def _told_of(self, which: str, doing: Doing | None) -> None:
        """Pages show how far the process is that edits, or the one that plays."""
        if doing is None:
            self._doing.pop(which, None)
        else:
            self._doing[which] = doing
        self._server.publish_doing({name: asdict(one) for name, one in [*self._doing.items()]})

    def _with_callers(self, order: Mapping[str, object]) -> Mapping[str, object]:
        """The order with the calls of helpers that the bar which it means runs in."""
        meant = order.get("site"), order.get("number") or 0
        for bar in self._bars:
            if (list(bar.site), bar.number) == meant:
                return {"callers": bar.callers, **order}
        return order

    def _content(self, shown: Answer) -> ReplayContent | Prepared:
        editor = bars.editor(shown, self._project, self._world, self._ground)
        self._motions = shown.motions
        content = replace(shown.shown(), editor=editor)
        return certifying.with_rate(content, self._rates.get(self._counted))
