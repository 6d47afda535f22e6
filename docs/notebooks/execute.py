"""Runs the notebooks of this folder from a clean kernel and writes them clean.

    python docs/notebooks/execute.py                      all of them, in place
    python docs/notebooks/execute.py first_steps --out DIR   one, into another folder

Needs nbclient, nbformat, ipykernel, matplotlib and pandas. The same code and libraries give the
same file: times, machine paths, HTML copies of tables and the editor's metadata are left out.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent.parent
HANGS = 300
"""Time [s] after which a cell counts as hanging."""
KEPT = ("image/png", "text/plain")
"""Kinds of output that stay, the best one first."""


def executed(path: Path) -> nbformat.NotebookNode:
    """The notebook with the outputs of a fresh run, in a folder of its own."""
    notebook = nbformat.read(path, as_version=4)
    with tempfile.TemporaryDirectory() as folder:
        client = NotebookClient(
            notebook,
            timeout=HANGS,
            kernel_name="python3",
            resources={"metadata": {"path": folder}},
        )
        client.execute()
    return cleaned(notebook, path.stem)


def cleaned(notebook: nbformat.NotebookNode, name: str) -> nbformat.NotebookNode:
    """The notebook without what differs from run to run or from machine to machine."""
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for number, cell in enumerate(notebook.cells):
        cell.metadata = {}
        cell.id = f"{name.replace('_', '-')}-{number}"
        if cell.cell_type == "code":
            cell.outputs = tidied(cell.outputs)
    return notebook


def tidied(outputs: Sequence[nbformat.NotebookNode]) -> list[nbformat.NotebookNode]:
    """One kind of each result, and the text of a stream in one piece: it comes in several."""
    kept: list[nbformat.NotebookNode] = []
    for output in outputs:
        if "data" in output:
            best = next(kind for kind in KEPT if kind in output.data)
            output.data = {best: output.data[best]}
            output.metadata = {}
        if kept and output.get("name", "") and kept[-1].get("name") == output.name:
            kept[-1].text += output.text
        else:
            kept.append(output)
    return kept


def main() -> int:
    """Execute the notebooks that were named."""
    names = sorted(path.stem for path in FOLDER.glob("*.ipynb"))
    parser = argparse.ArgumentParser(description="Run the notebooks of this folder.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--out", metavar="DIR", type=Path, default=FOLDER, help="default: in place")
    args = parser.parse_args()
    if unknown := sorted(set(args.names) - set(names)):
        parser.error(f"no notebook {', '.join(unknown)}; there are {', '.join(names)}")
    os.environ["PYTHONPATH"] = str(ROOT)  # the kernel's: the packages of this checkout
    for name in args.names or names:
        target = args.out / f"{name}.ipynb"
        nbformat.write(executed(FOLDER / f"{name}.ipynb"), target)
        print(f"{name}: {target.stat().st_size / 1000:.0f} kB")
    return 0


if __name__ == "__main__":
    sys.exit(main())
