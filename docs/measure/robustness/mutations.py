#!/usr/bin/env python3
"""Which mutations of the numerical crates the tests notice: the table of docs/measurements/robustness.md.

    mutations.py RECORD.csv WORK [VERSION]

cargo-mutants lists the mutations, every 30th of each crate is taken. All of them are compiled into one copy of VERSION (a
commit; HEAD), each into a branch of its function that the environment variable SLIPSTICK_MUTANT selects. So tests are
compiled once. Each mutation then runs the tests of its own crate and, if these pass, those of the facade, in one thread. A
mutation is noticed if a test fails or takes more than LIMIT seconds of processor time. WORK keeps the copy, and the outcome
of each mutation in outcomes.csv: an interrupted run goes on. The sums are added to RECORD.csv.
"""

import json
import os
import pathlib
import resource
import subprocess
import sys

CRATES = ["contact", "solid", "path", "linalg", "design"]
EVERY = 30
LIMIT = 120
# bodies replaced by values of types that have no such constructors
EXCLUDED = [r"(Vector3|Front|Contribution|PivotedColumns|Matrix)::", r"corner_normal -> "]
# tests of the facade that compute; the others read and write files
FACADE = """derivatives friction gradient invariance load_cases loads meshes newton parameters patch reference rounding symmetry
void""".split()
FAST = {"DEBUG": "0", "OPT_LEVEL": "1", "INCREMENTAL": "true", "CODEGEN_UNITS": "64"}
CHOICE = """
pub(crate) fn chosen_mutant() -> u32 {
    static CHOICE: std::sync::LazyLock<u32> =
        std::sync::LazyLock::new(|| std::env::var("SLIPSTICK_MUTANT").map_or(0, |n| n.parse().unwrap()));
    *CHOICE
}
"""


def sample(source):
    """The mutations: each with its crate, its name, and what replaces which part of which file."""
    found = []
    for crate in CRATES:
        command = ["cargo", "mutants", "--list", "--json", "--no-config", "--package", f"slipstick-{crate}"]
        command += [word for pattern in EXCLUDED for word in ("--exclude-re", pattern)]
        command += ["--shard", f"0/{EVERY}", "--sharding", "round-robin"]
        listed = subprocess.run(command, cwd=source, check=True, stdout=subprocess.PIPE).stdout
        found += [{"crate": crate, **mutant} for mutant in json.loads(listed)]
    return [{"number": number, **mutant} for number, mutant in enumerate(found, 1)]


def put(path, text):
    """Writes a file that is to be compiled, unless it is so already."""
    if path.read_text() != text:
        path.write_text(text)


def place(starts, at):
    return starts[at["line"] - 1] + at["column"] - 1


def body(text, begin, end):
    """Where the body of the function at text[begin:end] begins: its first brace outside of parentheses and comments."""
    depth = 0
    while begin < end:
        if text.startswith("//", begin):
            begin = text.index("\n", begin)
        elif text[begin] in "([":
            depth += 1
        elif text[begin] in ")]":
            depth -= 1
        elif text[begin] == "{" and depth == 0:
            return begin
        begin += 1
    raise ValueError("a function without a body")


def instrument(source, target, files, mutants):
    """Writes `files` of `source` to `target`, with a branch for each mutation; returns where these branches are: file, first
    line, last line, number."""
    branches = []
    for file in files:
        text = (source / file).read_text()
        starts = [0]
        for line in text.splitlines(keepends=True):
            starts.append(starts[-1] + len(line))
        functions = {}
        for mutant in (m for m in mutants if m["file"] == file):
            span = mutant["function"]["span"]
            begin, end = place(starts, span["start"]), place(starts, span["end"])
            functions.setdefault((body(text, begin, end), end), []).append(mutant)
        pieces, done, lines = [], 0, 1
        for (begin, end), group in sorted(functions.items()):
            assert begin >= done, f"a function within another in {file}"
            pieces.append(text[done:begin] + "{ match crate::chosen_mutant() {\n")
            for mutant in group:
                first, last = (place(starts, mutant["span"][side]) for side in ("start", "end"))
                mutated = text[begin:first] + " " + mutant["replacement"] + " " + text[last:end]
                before = sum(piece.count("\n") for piece in pieces) + 1
                pieces.append(f"{mutant['number']} => {mutated}\n")
                branches.append((file, before, before + mutated.count("\n"), mutant["number"]))
            pieces.append(f"_ => {text[begin:end]}\n}} }}")
            done = end
        pieces.append(text[done:])
        put(target / file, "".join(pieces))
    for crate in CRATES:
        name = f"crates/{crate}/src/lib.rs"
        put(target / name, (source / name).read_text() + CHOICE)
    return branches


def cargo(*arguments, target):
    environment = dict(os.environ, CARGO_TARGET_DIR=str(target.parent.parent / "target"))
    environment.update({f"CARGO_PROFILE_RELEASE_{key}": value for key, value in FAST.items()})
    command = ["cargo", *arguments, "--release", "--message-format=json"]
    out = subprocess.run(command, cwd=target, env=environment, stdout=subprocess.PIPE, check=False)
    return out.returncode, [json.loads(line) for line in out.stdout.splitlines() if line.startswith(b"{")]


def fits_a_branch(source, mutant):
    """Whether it lies in a function that can ask for the choice: a constant one cannot."""
    if not mutant["function"]:
        return False
    span = mutant["function"]["span"]
    lines = (source / mutant["file"]).read_text().splitlines()[span["start"]["line"] - 1 : span["end"]["line"]]
    return not any(line.lstrip().removeprefix("pub ").startswith("const fn") for line in lines)


def alone(source, target, mutant):
    """Writes the file of a mutation with this one and no other, for all choices."""
    text = (source / mutant["file"]).read_text()
    lines = text.splitlines(keepends=True)
    first, last = (
        sum(map(len, lines[: mutant["span"][side]["line"] - 1])) + mutant["span"][side]["column"] - 1
        for side in ("start", "end")
    )
    put(target / mutant["file"], text[:first] + " " + mutant["replacement"] + " " + text[last:])


def misfits(target, branches):
    """The numbers of mutations that do not compile as a branch, by where the errors are."""
    packages = [word for crate in CRATES for word in ("-p", f"slipstick-{crate}")]
    code, messages = cargo("check", "--keep-going", *packages, target=target)
    errors = [m["message"] for m in messages if m["reason"] == "compiler-message" and m["message"]["level"] == "error"]
    spans = [(span["file_name"], span["line_start"]) for error in errors for span in error["spans"]]
    found = {n for name, line in spans for file, first, last, n in branches if file == name and first <= line <= last}
    if code and not found:
        raise SystemExit("\n".join(error["rendered"] for error in errors))
    return found


def binaries(target, *arguments):
    """The test programs of packages, folder to run in and path; None if they do not compile."""
    code, messages = cargo("test", "--no-run", *arguments, target=target)
    if code:
        return None
    built = [m for m in messages if m["reason"] == "compiler-artifact" and m["executable"] and m["profile"]["test"]]
    order = {"lib": 0, "test": 1}
    built.sort(key=lambda m: (order.get(m["target"]["kind"][0], 2), m["target"]["name"]))
    return [(os.path.dirname(m["manifest_path"]), m["executable"]) for m in built if m["target"]["kind"][0] in order]


def failing(programs, number):
    """The first program that fails with a mutation, by its name; None if all pass."""
    environment = dict(os.environ, SLIPSTICK_MUTANT=str(number), RAYON_NUM_THREADS="2", PROPTEST_RNG_SEED="1")
    environment.pop("RUST_BACKTRACE", None)

    def limit():
        resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT))

    for folder, program in programs:
        silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "stdin": subprocess.DEVNULL}
        command = [program, "--test-threads=2", "-q"]
        try:
            code = subprocess.run(
                command, cwd=folder, env=environment, preexec_fn=limit, timeout=3 * LIMIT, check=False, **silent
            ).returncode
        except subprocess.TimeoutExpired:
            code = 1
        if code:
            return pathlib.Path(program).name.rsplit("-", 1)[0]
    return None


def main():
    record, work = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    version = sys.argv[3] if len(sys.argv) > 3 else "HEAD"
    version = subprocess.run(["git", "rev-parse", "--short", version], check=True, stdout=subprocess.PIPE, text=True)
    version = version.stdout.strip()
    source, target = work / version / "source", work / version / "mutated"
    for folder in (source, target):
        if not folder.exists():
            folder.mkdir(parents=True)
            archive = subprocess.Popen(["git", "archive", version], stdout=subprocess.PIPE)
            subprocess.run(["tar", "-x", "-C", folder], stdin=archive.stdout, check=True)
    mutants = sample(source)
    outcomes = {}
    written = work / version / "outcomes.csv"
    if written.exists():
        outcomes = dict(line.rsplit(";", 1) for line in written.read_text().splitlines())

    def own(mutant):
        return binaries(target, "-p", f"slipstick-{mutant['crate']}")

    def facade():
        return binaries(target, "-p", "slipstick", "--lib", *(word for name in FACADE for word in ("--test", name)))

    def judge(mutant, by, programs, last):
        test = failing(programs, mutant["number"])
        if test or last:
            outcomes[mutant["name"]] = f"{by} {test}" if test else "unnoticed"
            with written.open("a") as file:
                file.write(f"{mutant['name']};{outcomes[mutant['name']]}\n")
            print(mutant["name"], "->", outcomes[mutant["name"]], flush=True)

    files = sorted({mutant["file"] for mutant in mutants})
    together = [m for m in mutants if fits_a_branch(source, m)]
    while found := misfits(target, instrument(source, target, files, together)):
        together = [m for m in together if m["number"] not in found]
    # without a choice all tests pass
    programs = {crate: own({"crate": crate}) for crate in CRATES}
    assert not any(failing(of_crate, 0) for of_crate in programs.values())
    for mutant in (m for m in together if m["name"] not in outcomes):
        judge(mutant, "own", programs[mutant["crate"]], last=False)
    if any(m["name"] not in outcomes for m in together):
        programs = facade()
        assert not failing(programs, 0)
        for mutant in (m for m in together if m["name"] not in outcomes):
            judge(mutant, "facade", programs, last=True)
    # what does not fit in a branch is compiled by itself
    for mutant in (m for m in mutants if m["name"] not in outcomes):
        instrument(source, target, files, together)
        alone(source, target, mutant)
        for by, build in (("own", lambda: own(mutant)), ("facade", facade)):
            if mutant["name"] not in outcomes:
                programs = build()
                if programs is None:
                    outcomes[mutant["name"]] = "unviable"
                    with written.open("a") as file:
                        file.write(f"{mutant['name']};unviable\n")
                else:
                    judge(mutant, by, programs, last=by == "facade")
    if not record.exists():
        record.write_text("version,crate,sampled,unviable,own,facade,unnoticed\n")
    with record.open("a") as file:
        for crate in CRATES:
            all_of = [outcomes[m["name"]].split()[0] for m in mutants if m["crate"] == crate and m["name"] in outcomes]
            counts = [all_of.count(kind) for kind in ("unviable", "own", "facade", "unnoticed")]
            file.write(",".join(map(str, [version, crate, len(all_of), *counts])) + "\n")


if __name__ == "__main__":
    main()
