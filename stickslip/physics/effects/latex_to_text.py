"""LaTeX of the catalogue's equations as plain text with Greek letters, for a terminal."""

from __future__ import annotations

import re
import unicodedata

_WORDS = {
    r"\infty": "∞",
    r"\sum": "Σ",
    r"\int": "∫",
    r"\le": "≤",
    r"\ge": "≥",
    r"\to": "→",
    r"\propto": "∝",
    r"\times": "×",
    r"\cdot": "·",
    r"\pm": "±",
    r"\partial": "∂",
    r"\varepsilon": "ε",
    r"\varphi": "φ",
    r"\ell": "l",
    r"\ldots": "...",
    r"\dots": "...",
    r"\min": "min",
    r"\max": "max",
    r"\approx": "≈",
    r"\equiv": "≡",
    r"\ne": "≠",
    r"\langle": "<",
    r"\rangle": ">",
    r"\lVert": "|",
    r"\ll": "≪",
    r"\gg": "≫",
    r"\in": "∈",
}
_PRIMES = {r"\dot": "'", r"\ddot": "''"}
_BARE = (
    r"(?:left|right|mathrm|text|operatorname|mathbf|mathit|displaystyle|big|Big|bigl|bigr|bar|hat|tilde)(?![A-Za-z])"
)
_ARGUMENT = r"(\{[^{}]*\}|\\[A-Za-z]+|[A-Za-z0-9])"
_INDEX = r"(_(?:\w|\{(?:[^{}]|\{[^{}]*\})*\}))?"


def plain(latex: str) -> str:
    """Text of a formula: fractions as (a)/(b), derivatives in time as primes, sub- and superscripts as _ and ^."""
    text = re.sub(r"\\(qquad|quad)(?![A-Za-z])", "   ", latex)
    text = re.sub(r"\\[,;:! ]", " ", text)
    text = re.sub(r"\\(" + _BARE + ")", "", text)
    for _ in range(20):  # innermost braces first
        before = text
        text = re.sub(r"\\[dt]?frac\s*\{([^{}]*)\}\s*\{([^{}]*)\}", _fraction, text)
        text = re.sub(r"\\sqrt\s*\{([^{}]*)\}", r"sqrt(\1)", text)
        text = re.sub(r"\\(d?dot)\s*" + _ARGUMENT + _INDEX, _rate, text)
        text = re.sub(r"([_^])\{([^{}]*)\}", lambda m: m[1] + (m[2] if len(m[2]) == 1 else f"({m[2]})"), text)
        # not what a fraction or a root still waits for
        text = re.sub(r"(?<![_^}])(?<!frac)(?<!sqrt)\{([^{}]*)\}", r"\1", text)
        if text == before:
            break
    text = re.sub(r"\\[A-Za-z]+", lambda m: _word(m[0]), text)
    text = text.replace("\\{", "{").replace("\\}", "}").replace("\\|", "|").replace("\\", "")
    text = re.sub(r"_\(([^()]*)\)", lambda m: "_" + _short(m[1]), text)
    return re.sub(r" {2,}(?! {2})", lambda m: m[0] if len(m[0]) > 2 else " ", text).strip()


def _rate(match: re.Match) -> str:
    """A derivative in time, its prime behind the index."""
    return match[2].strip("{}") + (match[3] or "") + _PRIMES["\\" + match[1]]


def _fraction(match: re.Match) -> str:
    text = "/".join(part if re.fullmatch(r"[\w\\]+'*", part) else f"({part})" for part in match.groups())
    return text + (" " if re.match(r"[\w\\(]", match.string[match.end() :]) else "")


def _short(subscript: str) -> str:
    """A subscript of several characters; parentheses only where it is a sum or a condition."""
    if re.search(r"[+\-<>=≤≥]", subscript):
        return f"({subscript.strip()})"
    return re.sub(r"[\s,]+", ",", subscript.strip())


def _word(command: str) -> str:
    if command in _WORDS:
        return _WORDS[command]
    name = command[1:]
    case = "CAPITAL" if name[:1].isupper() else "SMALL"
    try:
        return unicodedata.lookup(f"GREEK {case} LETTER {'LAMDA' if name.lower() == 'lambda' else name.upper()}")
    except KeyError:
        return name
