"""Records how the URDF reader of ROS 2 parses mutated robot descriptions: urdfdom as in pin 4.1.0 from PyPI (urdfdom 6.0.0, tinyxml2
11.0.0).

    make.py PYTHON_WITH_PIN SEED BASE_FRAME TOOL_FRAME FILE > mutations.txt

Each line has: the position of the change in the text of FILE [characters], the number of removed characters, the inserted text
(hexadecimal; UTF-8, or Latin-1 if it has an invalid byte; - for nothing), and the result of urdfdom: - if it rejects the text, or the
names of the joints (hexadecimal) and then the position of the tool in the base frame with all joints at 0 [m].
"""
import random
import subprocess
import sys

PIECES = ["\n", "  ", "\t", "--", "<!-- -- -->", "<!-- a -->", "<!---->", "&", "&amp;", "&foo;", "&#65;", "&#0;", "&#xZ;", "<", ">", '"', "'",
          "=", "/", "?", "<!DOCTYPE robot>", "<!DOCTYPE robot [<!ENTITY a \"b\">]>", "<!ELEMENT a>", "<?pi a?>", "<?xml version=1.0?>",
          "<?xml version=\"1.0\"?>", "<![CDATA[a < b]]>", "]]>", "\x01", "\x1b", "\0", "\xe9", "\xff", "<a/>", "<a>", "</a>", "<a:b/>",
          "<a:b c:d=\"e\"/>", "<b c=\"<\"/>", "<b c='\"'/>", "<b c/>", "<b c=d/>", "<b c=\"1\" c=\"2\"/>", "<b c=\"1\"d=\"2\"/>", "<robot/>",
          "<robot name=\"x\"/>", "text", "\r\n", "\ufeff", "<1/>", "< a/>", "<a / >", "<a></a >", "<-a/>", "<a.b/>", "</>", "<>", "<!>", "<!a",
          "<?", "<!--", "<![CDATA["]

READER = """
import sys, pinocchio as pin
base, tool, file = sys.argv[1:]
for line in sys.stdin:
    with open(file, 'wb') as out: out.write(bytes.fromhex(line.strip()))
    try:
        model = pin.buildModelFromUrdf(file)
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        place = data.oMf[model.getFrameId(base)].actInv(data.oMf[model.getFrameId(tool)]).translation
        names = [name.encode().hex() for name in list(model.names)[1:]]
        print('@', ' '.join(names + [repr(round(float(x), 9)) for x in place]), flush=True)
    except Exception:
        print('@', '-', flush=True)
"""


def mutations(text, random):
    ends = [at for at, character in enumerate(text) if character in '<>\n" '] + [0, len(text)]
    root = text.index("<link")
    for piece in PIECES:
        for _ in range(6):
            near = random.choice(ends) + random.choice([0, 0, 1])
            yield (near if random.random() < 0.75 else random.randrange(len(text))), 0, piece
        yield from ((at, 0, piece) for at in [0, root, len(text)])
    for _ in range(60):
        yield random.randrange(len(text)), random.choice([1, 1, 2, 5]), ""
    for _ in range(10):
        at = random.randrange(len(text))
        yield at, len(text) - at, ""


def encoded(text):
    return text.encode("latin-1" if any(byte in text for byte in "\xe9\xff") else "utf-8")


def main():
    python, seed, base, tool, file = sys.argv[1:]
    text = open(file, encoding="utf-8", newline="").read()
    made = list(dict.fromkeys(mutations(text, random.Random(int(seed)))))
    texts = [encoded(text[:at] + piece + text[at + cut:]).hex() for at, cut, piece in made]
    read = subprocess.run([python, "-c", READER, base, tool, "/tmp/mutated.urdf"], input="\n".join(texts),
                          capture_output=True, text=True, errors="replace", check=True)
    verdicts = [line[2:] for line in read.stdout.splitlines() if line.startswith("@ ")]
    assert len(verdicts) == len(made)
    for (at, cut, piece), verdict in zip(made, verdicts):
        print(at, cut, encoded(piece).hex() or "-", verdict)


main()
