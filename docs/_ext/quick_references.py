"""Finds what a type names in the API reference without looking at all that is described there.

Sphinx holds the name of every type of every signature against the 5,000 names of the reference, up
to three times. A match ends with the last part of what is looked for, so only such names are tried.
"""

from __future__ import annotations

from sphinx.application import Sphinx
from sphinx.domains.python import ObjectEntry, PythonDomain
from sphinx.environment import BuildEnvironment

Objects = dict[str, ObjectEntry]


class QuickPythonDomain(PythonDomain):
    """Sphinx's, with an index of the last parts of names."""

    _tried: Objects | None = None
    _known = 0
    _by_last_part: dict[str, Objects] | None = None

    @property
    def objects(self) -> Objects:
        """All that is described, or while a name is looked for, what it may be."""
        return super().objects if self._tried is None else self._tried

    def find_obj(
        self,
        env: BuildEnvironment,
        modname: str,
        classname: str,
        name: str,
        type: str | None,
        searchmode: int = 0,
    ) -> list[tuple[str, ObjectEntry]]:
        """As Sphinx finds it."""
        self._tried = self._ending_with(name.removesuffix("()").rpartition(".")[2])
        try:
            return super().find_obj(env, modname, classname, name, type, searchmode)
        finally:
            self._tried = None

    def _ending_with(self, last_part: str) -> Objects:
        described = self.objects
        if self._by_last_part is None or self._known != len(described):
            self._known, self._by_last_part = len(described), {}
            for name, entry in described.items():
                self._by_last_part.setdefault(name.rpartition(".")[2], {})[name] = entry
        return self._by_last_part.get(last_part, {})


def setup(app: Sphinx) -> dict[str, bool]:
    """Take the place of Sphinx's domain."""
    app.add_domain(QuickPythonDomain, override=True)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
