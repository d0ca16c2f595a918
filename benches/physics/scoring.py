"""What an answer is worth against the truth of its case, and how the battery does in all."""

import math

AIMS = {"main": 0.90, "nothing else": 0.90, "none": 0.90, "unknown": 0.80}


def parameters(case, answer):
    """For each true parameter: (effect, name, said, std, true, z); None where it was not said."""
    rows = []
    found = {e["id"]: e for e in answer["effects"]}
    for effect, wanted in case.truth.items():
        for name, true in wanted.items():
            said = found.get(effect, {}).get("parameters", {}).get(name)
            std = found.get(effect, {}).get("std", {}).get(name)
            off = None if said is None else said - true
            if off is not None and name.endswith("heading_rad"):
                off = math.remainder(off, 2 * math.pi)
            rows.append((effect, name, said, std, true, off / std if off is not None and std else None))
    return rows


def judged(case, answer):
    """A row of the table: verdict, main, whether right (also by a class, where the log cannot tell), and what else was named."""
    named, main, verdict = set(answer["together"]), answer["main"], answer["verdict"]
    truth = set(case.truth)
    classes = [set(c["effects"] if isinstance(c, dict) else c) for c in answer["cannot_tell_apart"]]
    by_class = bool(case.alike) and main in case.alike and any(main in c and truth & c for c in classes)
    if case.kind == "none":
        right = verdict == "none"
    elif case.kind == "unlisted":
        right = verdict == "unknown"
    elif case.kind == "pair":
        right = verdict == "identified" and named == truth
    else:
        right = verdict == "identified" and (main in truth or by_class)
    allowed = truth | (set(case.alike) if by_class else set())
    return {
        "case": case.name, "kind": case.kind, "truth": sorted(truth), "verdict": verdict, "main": main,
        "probability": answer["main_probability"], "none": answer["none_probability"], "unknown": answer["unknown_probability"],
        "together": sorted(named), "right": right, "by_class": by_class, "main_is_true": main in truth or by_class,
        "all_named": truth <= named or by_class, "nothing_else": named <= allowed, "classes": [sorted(c) for c in classes],
        "remainder": (answer.get("remainder") or {}).get("share"), "parameters": parameters(case, answer),
        "acts_as": bool(named & set(case.acts_as)), "note": case.note,
    }


def rates(rows):
    """Shares over the battery, each as (right, of)."""
    def share(kind, key):
        of = [r for r in rows if r["kind"] == kind]
        return sum(bool(r[key]) for r in of), len(of)

    said = [p for r in rows for p in r["parameters"] if p[5] is not None]
    return {
        "main": share("single", "right"), "nothing else": share("single", "nothing_else"), "none": share("none", "right"),
        "unknown": share("unlisted", "right"), "pairs: main is one": share("pair", "main_is_true"),
        "pairs: both": share("pair", "all_named"), "pairs: both and nothing else": share("pair", "right"),
        "parameters within 3 std": (sum(abs(p[5]) < 3 for p in said), len(said)),
        "not named again": (sum(r.get("again") == [] for r in rows), sum(r.get("again") is not None for r in rows)),
    }


def table(rows):
    """The battery as a table of Markdown."""
    lines = ["| case | truth | verdict | main (probability) | together | parameters: said ± std, true | s | right |", "|---|---|---|---|---|---|---|---|"]
    for r in rows:
        told = "; ".join(
            f"{n} {'-' if v is None else f'{v:.4g}'} ± {'-' if s is None else f'{s:.1g}'}, {t:.4g}" for _, n, v, s, t, _ in r["parameters"]
        )
        main = f"{r['main']} ({r['probability'] or 0:.2f})" if r["main"] else "-"
        right = ("yes" if r["right"] else "no") + (" (class)" if r["by_class"] else "") + ("" if r["nothing_else"] or r["kind"] == "unlisted" else ", more")
        lines.append(f"| {r['case']} | {', '.join(r['truth']) or r['kind']} | {r['verdict']} | {main} | {', '.join(r['together']) or '-'} "
                     f"| {told or '-'} | {r['seconds']:.1f} | {right} |")
    return "\n".join(lines)
