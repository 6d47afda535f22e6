"""``go2-wbc dance``: a dance on the beats of a song, checked, played, and measured against them."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from controller.cli.common import ExitCode, Html, Json, ProgressLine, print_json, shown_path, whole
from controller.cli.motion_run import getting_ready

if TYPE_CHECKING:
    from motions import CheckedMotion, FeasibilityChecker
    from motions.music import Beats, Dance, DancedAccents
    from viz import ReplayContent


def run(
    song: Annotated[Path, "SONG", "a WAV, FLAC, OGG or MP3 file"],
    *,
    seed: Annotated[int, "N", "another seed is another dance", whole] = 0,
    moves: Annotated[tuple[str, ...], "NAME", "only these; a wrong name lists all"] = (),
    metre: Annotated[int | None, "N", "beats of a bar, 3 for a waltz; default: as heard"] = None,
    no_play: Annotated[bool, "compose and check it only"] = False,
    html: Annotated[Html, "write a 3D replay page with the music"] = None,
    json: Json = False,
) -> int:
    """Find the beats of a song, compose a dance on them, check it, and play it in MuJoCo.

    It prints how well the dance was on the beat. Needs the extra [music]. Exit code 0 if it was
    done, 1 if it is infeasible or was not done.

    Examples:
        go2-wbc dance song.wav
        go2-wbc dance song.wav --seed 3 --html dance.html
        go2-wbc dance waltz.mp3 --metre 3
        go2-wbc dance song.wav --moves nod sway twist tap_FR
        go2-wbc dance song.wav --no-play --json    its moves and their times
    """
    from controller.report_view import planned
    from motions import FeasibilityChecker
    from motions.music import beats, feasible_dance
    from viz import export_html

    with ProgressLine(is_quiet=json) as line:
        line.update(0.0, f"listening to {song.name}")
        found = beats(song, metre)
        line.update(0.1, "composing")
        checker = FeasibilityChecker(progress=line.solving)
        dance, checked = feasible_dance(found, seed, checker, moves)
        told = _told(song, found, dance)
        if no_play:
            content, ok = planned(checked), True
        else:
            content, measured = _played(dance, checked, checker, line)
            told |= measured
            ok = bool(measured["ok"])
        if html is not None:
            export_html(_shown(content, dance, found, song), html, title=dance.timeline.name)
    if json:
        print_json(told)
    else:
        _print(told)
        if html is not None:
            print(f"3D replay, offline: {shown_path(html)}")
    return ExitCode.OK if ok else ExitCode.FAILED


def _played(
    dance: Dance, checked: CheckedMotion, checker: FeasibilityChecker, line: ProgressLine
) -> tuple[Any, dict[str, Any]]:
    from controller.motion_measurement import during_motion, measure_motion
    from controller.report_view import performed
    from go2_wbc.plant import MujocoPlant
    from motions.music import danced

    plan = checked.plan
    with getting_ready(plan, MujocoPlant(), line) as (go2, truth):
        result = measure_motion(go2, truth, plan, checker.model)
        heard = danced(during_motion(go2, truth, plan.name), dance)
        content = performed(checked, go2.recording(), checker.model)
    reason = "" if result.ok else result.fall or result.reason
    return content, {"ok": result.ok, "reason": reason, **_accents(dance, heard)}


def _shown(content: ReplayContent, dance: Dance, found: Beats, song: Path) -> ReplayContent:
    """With the beats and the bars, the names of the moves on the strip, and the music."""
    from controller.report_view import AFTERWARDS

    run, bar = content.recording, (found.metre, found.downbeat)
    moves = zip(run.labels, dance.named(run.time - run.time[0]), strict=True)
    names = tuple(label if label == AFTERWARDS else move for label, move in moves)
    return replace(
        content,
        recording=replace(run, labels=names),
        beats=tuple(found.times.tolist()),
        bar=bar if found.metre > 1 else content.bar,
        sound=_music(song),
    )


def _music(song: Path) -> bytes:
    """As much of the song as can be danced, for the page."""
    from motions.music.choreography import LONGEST
    from motions.music.songs import RATE, mp3_of, read_sound

    return mp3_of(read_sound(song)[: round(LONGEST * RATE)])


def _accents(dance: Dance, heard: DancedAccents) -> dict[str, Any]:
    """How well the accents were on the beat, together and each."""
    late = 1000.0 * heard.errors(heard.wanted)
    return {
        "on_beat": heard.share_on(heard.wanted),
        "accents": [
            {
                "time": round(dance.time(accent), 3),
                "part": accent.part,
                "late_ms": None if math.isnan(error) else round(error, 1),  # it did not happen
            }
            for accent, error in zip(dance.accents, late.tolist(), strict=True)
        ],
    }


def _told(song: Path, found: Beats, dance: Dance) -> dict[str, Any]:
    return {
        "song": str(song),
        "tempo": round(found.tempo, 2),
        "beats": len(found.times),
        "metre": found.metre,
        "duration": round(found.duration, 3),
        "dance": dance.timeline.name,
        "feasible": True,
        "moves": [
            {"name": item.move.name, "time": round(float(dance.pulses[item.pulse]), 3)}
            for item in dance.moves
        ],
    }


def _print(told: dict[str, Any]) -> None:
    bars = f", bars of {told['metre']}" if told["metre"] > 1 else ""
    print(f"{told['song']}: {told['beats']} beats, {told['tempo']:.0f} a minute{bars}")
    print("-" * 80)
    for move in told["moves"]:
        print(f"  {move['time']:>7.2f} s  {move['name']}")
    print("-" * 80)
    if "accents" not in told:
        print(f"{told['dance']}: {len(told['moves'])} moves, feasible, not played")
        return
    late = [abs(item["late_ms"]) for item in told["accents"] if item["late_ms"] is not None]
    print(f"  {'accents within 40 ms of a beat':<38}{100 * told['on_beat']:>10.0f} %")
    if late:
        print(f"  {'accent off its beat, mean':<38}{sum(late) / len(late):>10.1f} ms")
        print(f"  {'accent off its beat, at most':<38}{max(late):>10.1f} ms")
    print("-" * 80)
    print("done" if told["ok"] else f"NOT done: {told['reason']}")
