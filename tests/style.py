"""Finds prose that is hard to read, as far as a program can, in comments, pages and parameter files. Prints each place, and fails if
there is any.

    tests/style.py [FILE OR FOLDER...]
"""

import re
import sys
from pathlib import Path

# The patterns to find, and what to write instead.
PATTERNS = [
    (r"\bso (many|often)\b(?! (as|that)\b)", "this many, this often, or the name of the number"),
    (r"\bnone (where|of which|if none)\b", "`None` if"),
    (r"(?<!there )\bis no (?!longer|more|less|further|faster|slower|larger|smaller|nearer|farther|worse|better|sooner|later|different|other)\w+", "is not a"),
    (r"\banew\b", "again"),
    (r"\bcounted from 1 arm\b|\b\d (runs|tasks|goals) \d", "a comma between the number and the next word"),
    (r"\b(stops?|moves?|reach|in time|rejected|refused) by (the given|its own|their own|their|its|name)\b", "with, within, after or as"),
    (r"\bits speed at which\b", "the relative clause next to its noun"),
    (r"\bnumber of (its|their) own\b", "the noun before its pronoun"),
    (r"\b(when|if)\b[^.;:]*, or because\b|\bevery other \w+ (begins|is|are|counts|has|moves)\b", "parts that are parallel, or any other"),
    (r"^(Of|Who|None|By how|So (much|long)) ", "a sentence, or a noun with its article, in place of a fragment"),
]
LONGEST_SENTENCE = 40  # words
COMMENT = {".rs": r"^\s*//[/!]?\s?(.*)$", ".py": r"^\s*#\s?(.*)$", ".sh": r"^\s*#\s?(.*)$", ".yaml": r"^\s*#\s?(.*)$", ".md": r"^(.*)$"}
SKIPPED = {"target", ".git", "data", "fixtures", "node_modules"}


def paragraphs(file):
    """The paragraphs of prose in a file, each with its first line number. Code, tables and links are left out."""
    comment, lines, first, is_code = re.compile(COMMENT[file.suffix]), [], 0, False
    for number, line in enumerate([*file.read_text().splitlines(), ""], 1):
        found = comment.match(line)
        text = found[1].strip() if found else ""
        is_fence = text.startswith("```")
        is_code ^= is_fence
        is_prose = text and not is_code and not is_fence and not re.match(r"[|#>]|\[[^]]+\]:", text)
        begins = not is_prose or re.match(r"[-*]|\d+\.", text)
        if begins and lines:
            yield first, " ".join(lines)
            lines = []
        if is_prose:
            first = first if lines else number
            lines.append(re.sub(r"^([-*]|\d+\.)\s+", "", text))


def faults(paragraph):
    """The problems of a paragraph."""
    plain = re.sub(r"`[^`]*`", "x", paragraph)
    for pattern, instead in PATTERNS:
        found = re.search(pattern, plain, re.IGNORECASE if not pattern.startswith("^") else 0)
        if found:
            yield f"{found[0].strip()!r}: write {instead}"
    for sentence in re.split(r"[.:;?!](?=\s|$)", plain):
        if len(sentence.split()) > LONGEST_SENTENCE:
            yield f"{len(sentence.split())} words in a sentence: {sentence.strip()[:60]}…"


def main(places):
    files = [place for place in places if place.is_file()]
    for folder in (place for place in places if place.is_dir()):
        files += [file for file in folder.rglob("*") if file.suffix in COMMENT and not SKIPPED & set(file.parts)]
    found = [(file, line, fault) for file in sorted(files) for line, text in paragraphs(file) for fault in faults(text)]
    for file, line, fault in found:
        print(f"{file}:{line}: {fault}")
    if not files:
        sys.exit("no file to check")
    print(f"{len(files)} files, {len(found)} places")
    sys.exit(bool(found))


if __name__ == "__main__":
    root = Path(__file__).parent.parent
    named = [Path(name) for name in sys.argv[1:]]
    main(named or [root / name for name in ["src", "tests", "msg_config", "launch_scripts", "README.md"]])
