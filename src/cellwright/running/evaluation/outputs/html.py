"""HTML of an evaluation's pages: their frame, their style sheet, tables, and texts that programs have chosen."""

from collections.abc import Iterable, Sequence
from html import escape as escape_markup

from cellwright.running.run import versions
from cellwright.util.errors import printable

STYLE = """
:root { color-scheme: light dark; --paper: #f6f7f9; --card: #ffffff; --ink: #1b2430; --soft: #5d6b7c; --line: #dde2e9;
  --lane: #eef1f5; --accent: #2563b0; --good: #1d8a52; --fair: #b7791f; --bad: #c4382f; --held: #d97a1f; }
@media (prefers-color-scheme: dark) { :root { --paper: #12171e; --card: #1a212b; --ink: #e4e9f0; --soft: #93a1b3;
  --line: #2c3643; --lane: #222b37; --accent: #6aa5ee; --good: #4cc38a; --fair: #e0ac4f; --bad: #f0766c;
  --held: #f0a050; } }
* { box-sizing: border-box; }
body { margin: 0; background: var(--paper); color: var(--ink);
  font: 15px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 26px; line-height: 1.25; margin: 0 0 4px; letter-spacing: -0.01em; overflow-wrap: anywhere; }
h2 { font-size: 17px; margin: 36px 0 12px; }
h3 { font-size: 14px; margin: 18px 0 6px; font-weight: 600; }
p { margin: 4px 0; }
.soft { color: var(--soft); } .good { color: var(--good); } .fair { color: var(--fair); } .bad { color: var(--bad); }
.tiles { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: 12px; margin-top: 22px; }
.tile, .card, details { background: var(--card); border: 1px solid var(--line); border-radius: 10px; }
.tile { padding: 14px 16px; }
.tile b { display: block; font-size: 24px; line-height: 1.2; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: 13px; }
.card { padding: 4px 16px; overflow-x: auto; }
table { border-collapse: collapse; width: 100%; font-variant-numeric: tabular-nums; }
th { text-align: left; font-size: 12px; font-weight: 600; color: var(--soft); padding: 9px 12px 7px 0; }
td { padding: 7px 12px 7px 0; border-top: 1px solid var(--line); vertical-align: middle; }
th.n, td.n { text-align: right; } .n + :not(.n) { padding-left: 14px; } td.tight { font-size: 13px; }
details { margin-bottom: 10px; }
summary { display: grid; grid-template-columns: minmax(170px, 1.5fr) 150px 110px minmax(120px, 1.6fr) 90px; gap: 14px;
  align-items: center; padding: 11px 16px; cursor: pointer; list-style: none; }
summary::-webkit-details-marker { display: none; }
summary b::before { content: "\\25B8"; display: inline-block; width: 18px; color: var(--soft); }
details[open] summary b::before { content: "\\25BE"; }
summary b { font-weight: 600; overflow-wrap: anywhere; }
.meter { height: 8px; border-radius: 4px; background: var(--lane); overflow: hidden; }
.meter i { display: block; height: 100%; border-radius: 4px; background: var(--accent); }
.meter i.good { background: var(--good); } .meter i.fair { background: var(--fair); }
.meter i.bad { background: var(--bad); }
.badge { font-size: 12px; font-weight: 600; padding: 2px 9px; border-radius: 20px; border: 1px solid currentColor;
  justify-self: start; }
.inside { padding: 2px 16px 16px; border-top: 1px solid var(--line); }
pre, code { font: 12.5px/1.5 ui-monospace, SFMono-Regular, Menlo, Consolas, monospace; }
pre { background: var(--lane); padding: 10px 12px; border-radius: 8px; overflow-x: auto; margin: 6px 0; }
code { overflow-wrap: anywhere; }
svg { display: block; } svg.histogram { width: 132px; height: 34px; }
svg.timeline { width: 100%; min-width: 620px; height: auto; margin-top: 10px; }
.scroll { overflow-x: auto; }
img.state { display: block; width: 480px; max-width: 100%; border-radius: 8px; margin: 8px 0 2px; }
svg text { font: 12px system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; fill: var(--soft); }
svg text.points { font-weight: 600; fill: var(--ink); font-size: 11px; }
.bar, .order { fill: var(--accent); } .open { fill: var(--bad); opacity: 0.75; } .lane { fill: var(--lane); }
.held { fill: var(--held); } .rule { stroke: var(--line); stroke-width: 1; }
.preparing_to_deliver { fill: var(--soft); opacity: 0.55; } .delivering { fill: var(--good); opacity: 0.75; }
.delivered { fill: var(--good); } .returning { fill: var(--soft); opacity: 0.35; }
.kit { fill: var(--card); stroke: var(--ink); stroke-width: 1.6; }
.key { display: flex; flex-wrap: wrap; gap: 16px; font-size: 12.5px; color: var(--soft); margin: 0 0 12px; }
.key svg { display: inline-block; width: 16px; height: 12px; vertical-align: -1px; margin-right: 5px; }
@media (max-width: 760px) { summary { grid-template-columns: 1fr 1fr; } }
@media print { body { background: none; } details { break-inside: avoid; } }
"""
"""Style sheet. It names no font, picture or file that a browser would have to fetch."""


def document(title: str, body: str, style: str = "") -> str:
    """Return a page, with the versions of what made it at its end.

    Args:
        title: of the window, as a text.
        body: its content as HTML.
        style: further rules of its style sheet.
    """
    known = ", ".join(f"{name} {version}" for name, version in versions().items())
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{escape(title)}</title><style>{STYLE}{style}</style></head>\n"
        f'<body><main>\n{body}\n<p class="soft">{escape(known)}</p>\n</main></body></html>\n'
    )


def table(heads: Sequence[tuple[str, str]], rows: Iterable[str]) -> str:
    """Return a table; heads are texts and the kinds of their columns."""
    head = "".join(f'<th class="{kind}">{escape(name)}</th>' for name, kind in heads)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def escape(text: str) -> str:
    """Return a text as HTML, without characters that are not seen, such as those that turn the direction of text."""
    return escape_markup(printable(text, len(text)))
